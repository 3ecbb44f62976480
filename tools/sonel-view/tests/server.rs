//! The server: who may ask, what nonsense gets, and that the numbers of the page are those of the programs.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use sonel::{Map, Parameter, ReceiverPoint, RenderOptions, Silent};
use sonel_testkit::test_folder::TestFolder;

const SCENE: &str = "name = \"<b>Room</b>\"\nshoebox = [5.0, 4.0, 3.0]\n[materials.walls]\nabsorption = 0.3\n\
                     [[sources]]\nname = \"s\"\nposition = [1.0, 1.0, 1.5]\n[[receivers]]\nname = \"r\"\nposition = [4.0, 3.0, 1.2]\n";

/// A program that serves, and how to ask it.
struct Served {
    program: Child,
    host: String,
    token: String,
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

impl Served {
    fn begin(folder: &TestFolder, file: &str, options: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sonel-view"));
        command.arg(folder.path(file)).args(["--no-open", "--quiet", "--packets", "2k"]).args(options);
        let mut program = command.stdout(Stdio::piped()).spawn().expect("the program starts");
        let mut line = String::new();
        let out = program.stdout.take().expect("a pipe");
        BufReader::new(out).read_line(&mut line).expect("an address");
        let (host, token) = line
            .trim()
            .strip_prefix("http://")
            .and_then(|rest| rest.split_once("/?token="))
            .expect("an address");
        Self { program, host: host.to_owned(), token: token.to_owned() }
    }

    /// Status and body of the answer to a request of these headers.
    fn raw(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(&self.host).expect("a server");
        let mut text = format!("{method} {path} HTTP/1.0\r\nContent-Length: {}\r\n", body.len());
        headers.iter().for_each(|(name, value)| text += &format!("{name}: {value}\r\n"));
        // A server that refuses a long request need not read it.
        let _ = stream.write_all(format!("{text}\r\n{body}").as_bytes());
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let status = answer.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
        (status, answer.split_once("\r\n\r\n").map_or(String::new(), |(_, body)| body.to_owned()))
    }

    fn ask(&self, path: &str, wish: &Value) -> (u16, Value) {
        let headers = [("Host", self.host.as_str()), ("X-Sonel-Token", self.token.as_str())];
        let (status, body) = self.raw("POST", &format!("/api/{path}"), &headers, &wish.to_string());
        (status, serde_json::from_str(&body).unwrap_or(Value::Null))
    }

    /// Waits for the map of the trace number `count`.
    fn wait_for_map(&self, count: u64) {
        for _ in 0..600 {
            let (_, state) = self.ask("state", &json!({}));
            assert!(state["failure"].is_null(), "{state}");
            if state["maps"] == count && state["share"].is_null() {
                return;
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        panic!("no map");
    }
}

fn traced() -> TestFolder {
    let folder = TestFolder::with(SCENE);
    let scene = sonel::Scene::load(folder.path("scene.toml"), &Silent).expect("a valid scene");
    let options = sonel::TraceOptions { packets: Some(2000), ..Default::default() };
    scene.trace(&options, &Silent).expect("a map").map.save(folder.path("a.sonelmap")).expect("a file");
    folder
}

#[test]
fn only_who_knows_the_token_is_answered_and_nonsense_changes_nothing() {
    let folder = traced();
    let served = Served::begin(&folder, "a.sonelmap", &[]);
    let (host, token) = (served.host.as_str(), served.token.as_str());
    let page = format!("/?token={token}");
    assert_eq!(served.raw("GET", &page, &[("Host", host)], "").0, 200);
    let wish = json!({ "window": "w", "listener": [4.0, 3.0, 1.2], "batches": 4 }).to_string();
    for (method, path, headers, body, status) in [
        ("GET", "/", vec![("Host", host)], "", 403),
        ("GET", "/?token=00", vec![("Host", host)], "", 403),
        ("GET", page.as_str(), vec![("Host", "evil.example:80")], "", 403),
        ("POST", "/api/render", vec![("Host", host)], &wish, 403),
        (
            "POST",
            "/api/render",
            vec![("Host", host), ("X-Sonel-Token", token), ("Origin", "http://evil.example")],
            &wish,
            403,
        ),
        (
            "POST",
            "/api/render",
            vec![("Host", host), ("X-Sonel-Token", token), ("Origin", "null")],
            &wish,
            403,
        ),
        ("OPTIONS", "/api/render", vec![("Host", host), ("X-Sonel-Token", token)], "", 404),
        ("POST", "/api/../../etc/passwd", vec![("Host", host), ("X-Sonel-Token", token)], "{}", 404),
        ("POST", "/api/render", vec![("Host", host), ("X-Sonel-Token", token)], "{\"window\":", 400),
        ("POST", "/api/render", vec![("Host", host), ("X-Sonel-Token", token)], "{}", 400),
        ("POST", "/api/render", vec![("Host", host), ("X-Sonel-Token", token)], &" ".repeat(2 << 20), 413),
    ] {
        assert_eq!(served.raw(method, path, &headers, body).0, status, "{method} {path} {headers:?}");
    }
    for (path, wish, message) in [
        ("render", json!({ "window": "w", "listener": [40.0, 3.0, 1.2] }), "outside"),
        ("render", json!({ "window": "w", "listener": [4.0, 3.0, 1.2], "source": 7 }), "1 sources"),
        (
            "render",
            json!({ "window": "w", "listener": [4.0, 3.0, 1.2], "changes": { "materials.roof.absorption": [0.5] } }),
            "walls",
        ),
        (
            "render",
            json!({ "window": "w", "listener": [4.0, 3.0, 1.2], "changes": { "roof": [0.5] } }),
            "not a change",
        ),
        ("grid", json!({ "window": "w", "height": 1.2, "spacing": 0.0 }), "spacing above 0"),
        ("grid", json!({ "window": "w", "height": 1.2, "spacing": 0.001 }), "at most 2000"),
        ("trace", json!({ "sources": [[1.0, 1.0, 1.0]] }), "no scene file"),
    ] {
        let (status, answer) = served.ask(path, &wish);
        let text = answer["error"].as_str().unwrap_or_default();
        assert!(status >= 400 && text.contains(message), "{path} {wish}: {status} {answer}");
    }
}

#[test]
fn the_page_has_the_numbers_of_the_programs() {
    let folder = traced();
    let served = Served::begin(&folder, "a.sonelmap", &[]);
    let map = Map::open(folder.path("a.sonelmap")).expect("a map");
    let at = [3.5, 2.25, 1.4];
    let rendered = map
        .render(&[ReceiverPoint::omni("x", at.into())], &RenderOptions::default(), &Silent)
        .expect("a response");
    let expected = rendered.response.parameters();
    let (status, answer) = served.ask("render", &json!({ "window": "w", "listener": at }));
    assert_eq!(status, 200, "{answer}");
    let row = |key: &str| {
        answer["pair"]["parameters"]
            .as_array()
            .and_then(|rows| rows.iter().find(|row| row["key"] == key))
            .cloned()
            .expect(key)
    };
    for parameter in [Parameter::T30, Parameter::Level, Parameter::ClarityC80] {
        for (band, (value, _)) in expected.array(parameter).into_iter().enumerate() {
            let shown = row(parameter.key())["values"][band][0].as_f64().expect("a value");
            assert!((shown - value).abs() <= 1e-12 * value.abs(), "{parameter:?} {band}: {shown} {value}");
        }
    }
    // The same place on a plane.
    let (_, plane) = served.ask("grid", &json!({ "window": "w", "height": 1.5, "spacing": 1.0 }));
    assert_eq!(plane["at"].as_array().map(Vec::len), Some(20), "{plane}");
    let (status, other) = served.ask(
        "render",
        &json!({ "window": "w", "listener": at, "changes": { "materials.walls.absorption": vec![0.4; 8] } }),
    );
    assert!(status == 200 && other["pair"]["parameters"] != answer["pair"]["parameters"]);
}

#[test]
fn noise_is_heard_while_the_listener_moves() {
    let folder = traced();
    let at = [3.5, 2.25, 1.4];
    let in_noise = |options: &[&str]| {
        let served = Served::begin(&folder, "a.sonelmap", options);
        let (_, answer) = served.ask("render", &json!({ "window": "w", "listener": at }));
        let (_, saved) = served.ask("save", &json!({ "listener": at }));
        let rows = answer["pair"]["parameters"].as_array().expect("rows").clone();
        let index = rows.iter().find(|row| row["key"] == "speech_transmission_index").expect("an index");
        let index = index["single"][0].as_f64().expect("a value");
        (index, rows.len(), saved["commands"][1].as_str().expect("a command").to_owned())
    };
    let (quiet, few, _) = in_noise(&[]);
    let (noisy, many, command) = in_noise(&["--noise", "80,80,80,80,80,80,80"]);
    assert!(noisy < quiet - 0.1 && many > few, "{quiet} {noisy}, {few} {many} rows");
    assert!(command.ends_with("--noise=80,80,80,80,80,80,80"), "{command}");
}

/// What another process of the machine can do without the token, or a broken page with it.
#[test]
fn endless_bodies_and_silent_connections_leave_the_server_serving() {
    let folder = traced();
    let served = Served::begin(&folder, "a.sonelmap", &[]);
    let (host, token) = (served.host.as_str(), served.token.as_str());
    let connect = |text: &str| {
        let mut stream = TcpStream::connect(host).expect("a server");
        stream.write_all(text.as_bytes()).expect("a server that reads");
        stream
    };
    let head = |length: u64, own: &str| {
        format!("POST /api/state HTTP/1.1\r\nHost: {host}\r\nContent-Length: {length}\r\n{own}\r\n")
    };
    let own = format!("X-Sonel-Token: {token}\r\n");
    for (own, status) in [("", "HTTP/1.1 403"), (&own, "HTTP/1.1 413")] {
        let mut answer = Vec::new();
        let mut stream = connect(&(head(100_000_000_000_000, own) + &" ".repeat(2 << 20)[..(1 << 20) + 1]));
        stream.set_read_timeout(Some(Duration::from_secs(5))).expect("a socket");
        // The rest is thrown away with the connection.
        let _ = stream.read_to_end(&mut answer);
        assert!(String::from_utf8_lossy(&answer).starts_with(status), "{}", String::from_utf8_lossy(&answer));
    }
    let texts = ["", "GET", &head(10, &own), &head(10, "")];
    let silent: Vec<TcpStream> = (0..800).map(|at| connect(texts[at % texts.len()])).collect();
    for _ in 0..20 {
        let begun = Instant::now();
        assert_eq!(served.ask("state", &json!({})).0, 200);
        assert!(begun.elapsed() < Duration::from_secs(2), "{:?}", begun.elapsed());
    }
    // Whoever sends nothing is not waited for.
    for mut stream in silent.into_iter().take(texts.len()) {
        stream.set_read_timeout(Some(Duration::from_secs(30))).expect("a socket");
        let end = stream.read_to_end(&mut Vec::new());
        assert!(end.is_ok(), "a silent connection stays open");
    }
}

#[test]
fn a_scene_is_traced_again_when_an_editor_writes_it() {
    let folder = TestFolder::with(SCENE);
    let served = Served::begin(&folder, "scene.toml", &[]);
    served.wait_for_map(2);
    // Times of files may be as coarse as this.
    std::thread::sleep(Duration::from_millis(50));
    folder.write("scene.toml", "name = ");
    let (_, broken) = served.ask("state", &json!({}));
    assert!(broken["failure"].as_str().is_some_and(|text| text.contains("scene.toml")), "{broken}");
    assert_eq!((&broken["maps"], &broken["pages"]), (&json!(2), &json!(0)));
    std::thread::sleep(Duration::from_millis(50));
    folder.write("scene.toml", SCENE.replace("absorption = 0.3", "absorption = 0.5"));
    served.wait_for_map(4);
    let (_, state) = served.ask("state", &json!({}));
    assert_eq!(state["map"]["materials"]["walls"]["absorption"][0], 0.5, "{state}");
    assert_eq!(state["pages"], 1);
}

#[test]
fn a_moved_source_is_traced_and_saved_beside_the_scene() {
    let folder = TestFolder::with(SCENE);
    let served = Served::begin(&folder, "scene.toml", &[]);
    // Each trace has a map of few packets first.
    served.wait_for_map(2);
    assert_eq!(served.ask("trace", &json!({ "sources": [[2.0, 1.0, 1.5]], "changes": {} })).0, 200);
    served.wait_for_map(4);
    let (_, answer) =
        served.ask("render", &json!({ "window": "w", "listener": [4.0, 3.0, 1.2], "batches": 4 }));
    assert_eq!((&answer["map"], &answer["pair"]["sourceAt"]), (&json!(4), &json!([2.0, 1.0, 1.5])));
    for number in 2..4 {
        let (status, saved) = served.ask("save", &json!({ "listener": [4.0, 3.0, 1.2] }));
        let name = format!("scene-{number}.toml");
        assert!(
            status == 200 && saved["files"][0].as_str().is_some_and(|file| file.ends_with(&name)),
            "{saved}"
        );
        assert!(folder.text(&name).contains("position = [2.0, 1.0, 1.5]"));
        let commands = saved["commands"].as_array().expect("commands");
        assert!(
            commands[0].as_str().is_some_and(|line| line.starts_with("sonel-trace") && line.contains(&name)),
            "{saved}"
        );
        assert!(
            commands[1].as_str().is_some_and(|line| line.ends_with("--receiver listener=4,3,1.2")),
            "{saved}"
        );
    }
    let row = json!({ "listener": [4.0, 3.0, 1.2], "receivers": [["front row", [3.0, 2.0, 1.2]]] });
    let (_, saved) = served.ask("save", &row);
    let both = "--receiver listener=4,3,1.2 --receiver 'front row=3,2,1.2'";
    assert!(saved["commands"][1].as_str().is_some_and(|line| line.ends_with(both)), "{saved}");
    // What is there is not replaced.
    folder.write("scene-5.sonelmap", "mine");
    let (_, saved) = served.ask("save", &json!({ "listener": [4.0, 3.0, 1.2] }));
    assert!(saved["commands"][0].as_str().is_some_and(|line| line.contains("scene-5-2.sonelmap")), "{saved}");
    assert_eq!(folder.text("scene.toml"), SCENE);
    let (status, refused) = served.ask("trace", &json!({ "sources": [[20.0, 1.0, 1.5]] }));
    assert_eq!(status, 200, "{refused}");
    // A trace that fails says why and leaves the map.
    let failure = (0..600).find_map(|_| {
        std::thread::sleep(std::time::Duration::from_millis(50));
        served.ask("state", &json!({})).1["failure"].as_str().map(str::to_owned)
    });
    assert!(failure.is_some_and(|text| text.contains("outside")));
    assert_eq!(
        served.ask("render", &json!({ "window": "w", "listener": [4.0, 3.0, 1.2], "batches": 4 })).0,
        200
    );
}

/// What is asked of a frozen page when nobody reads what the program prints, or the disk below that is full. A server whose address is lost ends.
#[test]
#[cfg(target_os = "linux")]
fn no_page_is_lost_without_a_word() {
    let folder = traced();
    let program = env!("CARGO_BIN_EXE_sonel-view");
    for line in ["a.sonelmap -o out/x.html", "scene.toml --packets 500 -o out/x.html"] {
        let faults = sonel_testkit::broken_streams::faults(&folder, &format!("{program} {line}"), false);
        assert!(faults.is_empty(), "{faults:#?}");
    }
    let full = std::fs::File::options().write(true).open("/dev/full").expect("a full disk");
    let served = Command::new(program).arg(folder.path("a.sonelmap")).arg("--no-open").stdout(full).output();
    assert_eq!(served.expect("a program that starts").status.code(), Some(2));
}
