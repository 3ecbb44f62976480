//! What is said when the machine fails beneath a rendering: the map is cut off, memory is short.
#![cfg(target_os = "linux")]

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use clap::Parser;
use sonel_testkit::test_folder::{Ended, TestFolder};

const SCENE: &str = r#"
name = "box"
shoebox = [5.0, 4.0, 3.0]
duration_s = 0.5
[bands]
center_frequencies_hz = [500, 1000]
[materials.walls]
absorption = 0.1
scattering = 0.5
[[sources]]
name = "speaker"
position = [1.0, 1.0, 1.5]
"#;
const PROGRAM: &str = env!("CARGO_BIN_EXE_sonel-render");

fn traced(packets: &str) -> TestFolder {
    let folder = TestFolder::with(SCENE);
    let line = folder.line("sonel-trace", "scene.toml", "room.sonelmap", &["--packets", packets]);
    sonel_trace::run(&sonel_trace::Arguments::parse_from(line), &mut std::io::sink(), &mut std::io::sink())
        .expect("a valid scene");
    folder
}

/// The paths are read again for every eight receivers: the cut is met long before the end.
#[test]
fn a_map_cut_off_while_it_is_rendered_is_one_message_and_leaves_nothing() {
    let folder = traced("20k");
    let words = [
        "room.sonelmap",
        "-o",
        "room.npz",
        "--quiet",
        "--grid",
        "0.5:4.5:20,0.5:3.5:20,1.2",
        "--bin",
        "0.01",
    ];
    let child = Command::new(PROGRAM)
        .current_dir(folder.folder())
        .args(words)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while folder.names().len() < 3 {
        assert!(begun.elapsed() < Duration::from_secs(60), "no output was begun");
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(300));
    std::fs::File::options().write(true).open(folder.path("room.sonelmap")).unwrap().set_len(4096).unwrap();
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(2), "{said}");
    assert!(said.starts_with("error: an input was truncated") && said.lines().count() == 1, "{said}");
    assert_eq!(folder.names(), ["room.sonelmap", "scene.toml"]);
}

/// The same bytes in the other order, in place: no signal comes, and what is read later is of another content.
#[test]
fn a_map_that_is_overwritten_while_it_is_rendered_is_an_error() {
    let folder = traced("20k");
    let words = "room.sonelmap -o room.npz --quiet --grid 0.5:4.5:12,0.5:3.5:12,1.2 --bin 0.01";
    let mut command = Command::new(PROGRAM);
    let child =
        command.current_dir(folder.folder()).args(words.split(' ')).stderr(Stdio::piped()).spawn().unwrap();
    let begun = Instant::now();
    while folder.names().len() < 3 {
        assert!(begun.elapsed() < Duration::from_secs(60), "no output was begun");
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(300));
    let turned: Vec<u8> = folder.bytes("room.sonelmap").into_iter().rev().collect();
    let mut file = std::fs::File::options().write(true).open(folder.path("room.sonelmap")).unwrap();
    std::io::Write::write_all(&mut file, &turned).unwrap();
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(2), "{said}");
    assert!(said.contains("was changed"), "{said}");
    assert_eq!(folder.names(), ["room.sonelmap", "scene.toml"]);
}

#[test]
fn memory_that_is_not_there_is_told_with_a_remedy() {
    let folder = traced("500");
    // Echograms of half a million bins.
    let words = "room.sonelmap -o room.npz --quiet --grid 1:4:4,2,1.2 --bin 0.000001";
    for threads in [1, 1000] {
        let render = format!("ulimit -v 400000; exec {PROGRAM} {words} --threads {threads}");
        let ended = Ended::of(Command::new("sh").current_dir(folder.folder()).args(["-c", &render]));
        assert_eq!(ended.code, Some(2), "{ended:?}");
        assert!(ended.err.contains("take fewer --threads"), "{ended:?}");
    }
    assert_eq!(folder.names(), ["room.sonelmap", "scene.toml"]);
}

#[test]
fn impulse_responses_on_a_full_disk_are_one_message_about_the_disk() {
    let folder = traced("500");
    // A limit on the size of files fails a write as a full disk does: the response fits, 48 000 samples a second do not.
    let words = "room.sonelmap -o room.npz --quiet --receiver a=4,3,1 --bin 0.1 --wav sounds";
    let render = format!("trap '' XFSZ; ulimit -f 40; exec {PROGRAM} {words}");
    let said = Ended::of(Command::new("sh").current_dir(folder.folder()).args(["-c", &render])).refused();
    assert!(said.contains("File too large") && !said.contains("not a WAV file"), "{said}");
    assert_eq!(said.matches("File too large").count(), 1, "{said}");
}

#[test]
fn a_folder_that_cannot_be_made_is_told_before_the_rendering() {
    let folder = traced("500");
    let render = |wav: &str| {
        let words = ["room.sonelmap", "-o", "room.npz", "--receiver", "a=4,3,1", "--wav", wav];
        Ended::of(Command::new(PROGRAM).current_dir(folder.folder()).args(words)).refused()
    };
    let (missing, file) = (render("no/sounds"), render("scene.toml"));
    assert!(missing.contains("cannot make the folder no/sounds"), "{missing}");
    assert!(file.contains("scene.toml is not a folder"), "{file}");
    assert_eq!(folder.names(), ["room.sonelmap", "scene.toml"]);
}

/// From too little for a thread to ample: what the system refuses is one error and code 2, whatever was about to be done. The standard library
/// may say before how much memory it was refused.
#[test]
fn too_little_memory_is_one_error_at_every_size() {
    let folder = traced("500");
    let mut is_enough = false;
    for mebibytes in (24..400).step_by(40) {
        let words = "room.sonelmap -o room.npz --quiet --threads 2 --grid 1:4:3,2,1.2 --bin 0.0001";
        let render = format!("ulimit -v {}; exec {PROGRAM} {words}", mebibytes << 10);
        let ended = Ended::of(Command::new("sh").current_dir(folder.folder()).args(["-c", &render]));
        is_enough |= ended.code == Some(0);
        let errors = ended.err.lines().filter(|line| line.starts_with("error: ")).count();
        let is_told = ended.code == Some(2) && errors == 1;
        assert!(ended.code == Some(0) || is_told, "{mebibytes} MiB: {ended:?}");
    }
    assert!(is_enough, "the last limits are ample");
}

/// Both are asked before the rendering, and the largest is announced.
#[test]
fn memory_that_is_not_allowed_is_refused_before_the_rendering() {
    let folder = traced("500");
    let render = |memory: &str| {
        let words =
            ["room.sonelmap", "-o", "room.npz", "--grid", "0.5:4.5:10,0.5:3.5:10,1.2", "--rays", "100"];
        Ended::of(Command::new(PROGRAM).current_dir(folder.folder()).args(words).args(["--memory", memory]))
    };
    let said = render("50M").refused();
    assert!(
        said.contains("the run needs about: memory") && said.contains("--memory allows 50.0 MB"),
        "{said}"
    );
    assert!(render("0").refused().contains("--memory 0 is no limit"));
    assert_eq!(render("1G").code, Some(0));
}

/// The response and the impulse responses appear together.
#[test]
fn interrupted_impulse_responses_leave_all_outputs_or_none() {
    let folder = traced("500");
    let words = "room.sonelmap -o room.npz --quiet --grid 1:4:12,1:3:8,1.2 --bin 0.1 --rays 100 --wav sounds";
    let render = || {
        let mut command = Command::new(PROGRAM);
        command.current_dir(folder.folder()).args(words.split(' ')).stderr(Stdio::piped());
        command.spawn().unwrap()
    };
    let sounds = || std::fs::read_dir(folder.path("sounds")).map_or(0, |entries| entries.count());
    let child = render();
    let begun = Instant::now();
    while sounds() < 4 {
        assert!(begun.elapsed() < Duration::from_secs(60), "no impulse response was begun");
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap().success());
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains("older outputs are untouched"), "{said}");
    assert_eq!((sounds(), folder.path("room.npz").exists()), (0, false));
}

/// What is asked of a rendering when nobody reads what it prints, or the disk below that is full.
#[test]
fn no_rendering_ends_well_without_what_it_was_asked_for() {
    let folder = traced("500");
    folder.write(
        "dry.wav",
        std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/seeds/wav/float.wav")).unwrap(),
    );
    folder.write("path.csv", "time,x,y,z\n0,3,2,1.2\n0.1,3,2,1.2\n");
    let lines = [
        "room.sonelmap -o out/x.npz --receiver seat=3,2,1.2 --parameters",
        "room.sonelmap -o out/x.npz --receiver seat=3,2,1.2 --json --rays 16",
        "room.sonelmap -o out/x.npz --receiver seat=3,2,1.2 --wav out/sounds --ambix 1",
        "room.sonelmap -o out/x.npz --wav out/sounds --wav-rate 8000 --path path.csv --recording dry.wav",
        "room.sonelmap -o out/x.npz --receiver seat=3,2,1.2 --until level<9dB --rays 16 --order 1",
    ];
    let faults_of =
        |line: &&str| sonel_testkit::broken_streams::faults(&folder, &format!("{PROGRAM} {line}"), false);
    let faults: Vec<String> = lines.iter().flat_map(faults_of).collect();
    assert!(faults.is_empty(), "{faults:#?}");
}
