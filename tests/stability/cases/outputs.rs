//! Outputs: whatever the scene, no program prints or writes a number that is none. A parameter is a number with an interval,
//! or null with a reason.

use clap::Parser;
use serde_json::Value;
use sonel_testkit::test_folder::TestFolder;

use super::form;

/// A box of 5 × 4 × 3 m of `wall`, with more of a scene file behind it.
fn boxed(wall: &str, more: &str) -> String {
    format!(
        "shoebox = [5.0, 4.0, 3.0]\n{more}\n[bands]\ncenter_frequencies_hz = [500, 1000]\n\
         [materials.walls]\n{wall}\n\
         [[sources]]\nname = \"source\"\nposition = [1.0, 1.0, 1.5]\n\
         [[receivers]]\nname = \"receiver\"\nposition = [3.9, 2.8, 1.2]\n"
    )
}

/// A black sheet across a black box: nothing gets to the receiver behind it.
fn silent() -> (String, &'static str) {
    let mesh = "v 0 0 0\nv 5 0 0\nv 5 4 0\nv 0 4 0\nv 0 0 3\nv 5 0 3\nv 5 4 3\nv 0 4 3\n\
                v 2.5 0 0\nv 2.5 4 0\nv 2.5 4 3\nv 2.5 0 3\nusemtl walls\n\
                f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\nf 9 10 11 12\n";
    let scene = boxed("absorption = 1.0\nscattering = 0.5", "duration_s = 0.1");
    (scene.replace("shoebox = [5.0, 4.0, 3.0]", "mesh = \"room.obj\""), mesh)
}

/// One small tile in the open: nearly all packets escape.
fn tile() -> (String, &'static str) {
    let scene = boxed("absorption = 0.2\nscattering = 0.5", "duration_s = 0.1");
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl walls\nf 1 2 3\n";
    (scene.replace("shoebox = [5.0, 4.0, 3.0]", "mesh = \"room.obj\""), mesh)
}

/// Name, scene file, mesh, options of `sonel-trace`, options of `sonel-render`.
type Case = (&'static str, String, &'static str, &'static [&'static str], &'static [&'static str]);

/// Scenes and options of which next to nothing can be said.
fn hard_cases() -> Vec<Case> {
    const USUAL: &str = "absorption = 0.2\nscattering = 0.5";
    let (behind_a_sheet, room) = silent();
    let alone = tile();
    vec![
        ("no energy", behind_a_sheet, room, &["--packets", "200"], &[]),
        ("one packet", boxed(USUAL, ""), "", &["--packets", "1"], &[]),
        ("one batch", boxed(USUAL, ""), "", &["--packets", "20", "--batches", "1"], &[]),
        ("black", boxed("absorption = 1.0", ""), "", &["--packets", "200"], &["--estimator", "gather"]),
        ("lossless", boxed("absorption = 0.0", "duration_s = 0.2"), "", &["--packets", "2k"], &[]),
        ("one bin", boxed(USUAL, "duration_s = 0.02"), "", &["--packets", "200"], &["--bin", "0.02"]),
        ("out of reach", boxed(USUAL, "duration_s = 0.002"), "", &["--packets", "200"], &["--order", "0"]),
        ("a tile in the open", alone.0, alone.1, &["--packets", "200"], &[]),
        (
            "the paper's method",
            boxed("absorption = 0.99\nscattering = 0.0", "duration_s = 0.1"),
            "",
            &["--packets", "2", "--mode", "paper"],
            &["--estimator", "paper"],
        ),
        (
            "spheres alone",
            boxed("absorption = [0.0, 1.0]\nscattering = [1.0, 0.0]", "duration_s = 0.05"),
            "",
            &["--packets", "3", "--spectral", "per-band"],
            &["--estimator", "sphere"],
        ),
    ]
}

/// What a program says: standard output, and the log.
fn said(
    run: impl FnOnce(&mut Vec<u8>, &mut Vec<u8>) -> anyhow::Result<sonel_console::Outcome>,
) -> Result<[String; 2], String> {
    let (mut out, mut log) = (Vec::new(), Vec::new());
    run(&mut out, &mut log).map_err(|error| format!("{error:#}"))?;
    Ok([out, log].map(|bytes| String::from_utf8(bytes).expect("text")))
}

fn trace(folder: &TestFolder, map: &str, options: &[&str]) -> Result<[String; 2], String> {
    let mut line = folder.line("sonel-trace", "scene.toml", map, options);
    line.retain(|word| word != "--quiet");
    said(|out, log| sonel_trace::run(&sonel_trace::Arguments::try_parse_from(line)?, out, log))
}

fn render(folder: &TestFolder, map: &str, response: &str, options: &[&str]) -> Result<[String; 2], String> {
    let mut line = folder.line("sonel-render", map, response, options);
    line.retain(|word| word != "--quiet");
    said(|out, log| sonel_render::run(&sonel_render::Arguments::try_parse_from(line)?, out, log))
}

/// Runs `sonel-analyze` with `words`, of which those with a dot are files of `folder`.
fn analyze(folder: &TestFolder, words: &[&str]) -> Result<[String; 2], String> {
    let place = |word: &&str| {
        if word.contains('.') { folder.path(word).display().to_string() } else { (*word).to_owned() }
    };
    let line = std::iter::once("sonel-analyze".to_owned()).chain(words.iter().map(place));
    said(|out, log| sonel_analyze::run(&sonel_analyze::Arguments::try_parse_from(line)?, out, log))
}

/// What is no number in a text.
fn unmatched(text: &str) -> Vec<&str> {
    let words = text.split(|letter: char| !letter.is_alphanumeric());
    let none = ["nan", "inf", "infinity"];
    words.filter(|word| none.contains(&word.to_ascii_lowercase().as_str())).collect()
}

/// Keys whose null says by itself what it means (docs/interface.md): an option that was not given, what is just noticeable of a window's level, measures of noise
/// where there is none, a plan for which the fewest packets will do, a cost that was no part of the run, a target that wants no more.
const SPEAKING_NULLS: [&str; 12] = [
    "order",
    "radius_m",
    "effective_sample_size",
    "significance",
    "limited_by",
    "trace_cpu_s",
    "render_cpu_s",
    "map_bytes",
    "worst",
    "rays_wanted",
    "packets_wanted",
    "just_noticeable_differences",
];

/// Paths of nulls without a reason beside them.
fn unexplained(value: &Value, path: &str, explained: bool, found: &mut Vec<String>) {
    match value {
        Value::Null if !explained => found.push(path.to_owned()),
        Value::Array(values) => {
            for (index, value) in values.iter().enumerate() {
                unexplained(value, &format!("{path}[{index}]"), explained, found);
            }
        }
        Value::Object(fields) => {
            // A plan lists what cannot be read, with reasons, beside its rows.
            let listed =
                fields.get("not_estimable").and_then(Value::as_array).is_some_and(|list| !list.is_empty());
            let reason =
                fields.get("reason").and_then(Value::as_str).is_some_and(|reason| !reason.is_empty());
            for (key, value) in fields {
                // A reason explains the null beside it, no deeper one.
                let explains = (reason && value.is_null()) || SPEAKING_NULLS.contains(&key.as_str());
                if listed && key == "rows" {
                    continue;
                }
                unexplained(value, &format!("{path}.{key}"), explains, found);
            }
        }
        _ => {}
    }
}

fn judge(what: &str, text: &str, is_json: bool) -> Vec<String> {
    let mut wrong = Vec::new();
    if is_json {
        let value: Value =
            serde_json::from_str(text).unwrap_or_else(|error| panic!("{what}: {error}\n{text}"));
        unexplained(&value, "", false, &mut wrong);
    } else {
        wrong.extend(unmatched(text).into_iter().map(str::to_owned));
    }
    wrong.into_iter().map(|found| format!("{what}: {found}")).collect()
}

/// Everything that the programs say of one case.
fn strange_outputs((name, scene, mesh, tracing, rendering): &Case) -> Vec<String> {
    let folder = TestFolder::with(scene);
    folder.write("room.obj", mesh);
    let mut wrong = Vec::new();
    let mut take = |what: &str, result: Result<[String; 2], String>, is_json: bool| {
        let what = format!("{name}, {what}");
        match result {
            Ok([out, log]) => {
                wrong.extend(judge(&what, &out, is_json));
                wrong.extend(judge(&what, &log, false));
            }
            // A refusal is a sentence.
            Err(reason) => {
                wrong.extend(judge(&format!("{what}, refused"), &reason, false));
            }
        }
    };
    for (map, seed) in [("a.sonelmap", "1"), ("b.sonelmap", "2")] {
        take("trace", trace(&folder, map, &[*tracing, &["--json", "--seed", seed]].concat()), true);
    }
    for (map, response) in [("a.sonelmap", "a.npz"), ("b.sonelmap", "b.npz")] {
        take(
            "render",
            render(&folder, map, response, &[*rendering, &["--json", "--rays", "256"]].concat()),
            true,
        );
    }
    for file in ["a.sonelmap", "a.npz"] {
        take("inspect", analyze(&folder, &["inspect", file]), false);
        take("inspect --json", analyze(&folder, &["inspect", file, "--json"]), true);
    }
    for (a, b) in [("a.sonelmap", "b.sonelmap"), ("a.npz", "b.npz")] {
        take("diff", analyze(&folder, &["diff", a, b]), false);
        let told = analyze(&folder, &["diff", a, b, "--json"]);
        let is_json = told.is_ok();
        take("diff --json", told, is_json);
    }
    take("verify", analyze(&folder, &["verify", "a.sonelmap"]), false);
    for (format, is_json) in [("table", false), ("csv", false), ("json", true)] {
        take(format, analyze(&folder, &["parameters", "a.npz", "--format", format]), is_json);
    }
    take("export", analyze(&folder, &["export", "a.sonelmap", "-o", "sonels.csv"]), false);
    take("plot", analyze(&folder, &["plot", "a.npz", "-o", "a.svg"]), false);
    for file in ["sonels.csv", "a.svg"] {
        take(file, Ok([folder.text(file), String::new()]), false);
    }
    // Reading a response refuses what is not finite.
    sonel_echogram::Response::read(std::io::Cursor::new(folder.bytes("a.npz"))).expect("a response");
    wrong
}

#[test]
fn whatever_the_scene_figures_are_numbers_or_have_reasons() {
    let wrong: Vec<String> = hard_cases().iter().flat_map(strange_outputs).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Plans and trade-offs of rooms in which nothing can be measured.
#[test]
fn plans_of_hopeless_rooms_have_reasons() {
    let mut wrong = Vec::new();
    let hopeless = [0, 3, 6].map(|index| hard_cases().swap_remove(index));
    for (name, scene, mesh, tracing, _) in hopeless.into_iter().take(form(2, 3)) {
        let folder = TestFolder::with(&scene);
        folder.write("room.obj", mesh);
        trace(&folder, "a.sonelmap", tracing).expect("a valid scene");
        for options in
            [&["--plan"][..], &["--until", "level<0.1dB,t30<1%", "--rays", "512", "--at-most", "1s"]]
        {
            let what = format!("{name}, render {}", options[0]);
            for is_json in [false, true] {
                let json = is_json.then_some("--json");
                let options: Vec<&str> = options.iter().copied().chain(json).collect();
                match render(&folder, "a.sonelmap", "a.npz", &options) {
                    Ok([out, log]) => {
                        wrong.extend(judge(&what, &out, is_json));
                        wrong.extend(judge(&what, &log, false));
                    }
                    Err(reason) => wrong.extend(judge(&what, &reason, false)),
                }
            }
        }
        let plan = trace(&folder, "unused.sonelmap", &["--plan", "--packets", "2k"]);
        wrong.extend(judge(name, &plan.map_or_else(|error| error, |said| said.concat()), false));
        if let Ok([out, _]) = trace(&folder, "unused.sonelmap", &["--plan", "--json", "--packets", "2k"]) {
            wrong.extend(judge(name, &out, true));
        }
        let sweep = ["tradeoff", "scene.toml", "-o", "study.d", "--packets", "64,128", "--repeats", "2"];
        if let Err(error) = analyze(&folder, &sweep) {
            wrong.extend(judge(name, &error, false));
            continue;
        }
        wrong.extend(judge(&format!("{name}, README.md"), &folder.text("study.d/README.md"), false));
        wrong.extend(judge(&format!("{name}, tradeoff.json"), &folder.text("study.d/tradeoff.json"), true));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The sibling: what the judgement must find.
#[test]
fn strange_numbers_are_found_wherever_they_stand() {
    for text in ["level NaN dB", "-inf ± 0.1", "a,,inf,b", "M 1.0 nan L"] {
        assert!(!judge("text", text, false).is_empty(), "{text}");
    }
    assert!(judge("text", "the infinite nankeen of 3 dB", false).is_empty());
    for text in
        [r#"{"value":null}"#, r#"{"a":[{"reason":"so","b":[1,null]}]}"#, r#"{"value":null,"reason":""}"#]
    {
        assert!(!judge("json", text, true).is_empty(), "{text}");
    }
    assert!(judge("json", r#"{"a":[{"value":null,"reason":"no energy"}]}"#, true).is_empty());
}
