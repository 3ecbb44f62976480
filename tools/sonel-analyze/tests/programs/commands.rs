//! `verify`, `inspect` and `parameters` from outside: ledgers, listings, formats, and files that are none.

use serde_json::Value;
use sonel_echogram::{Arrivals, Provenance, Response};
use sonel_testkit::test_folder::TestFolder;

use crate::{analyze, trace};

pub(crate) const MAP: &str = "room.sonelmap";
pub(crate) const RESPONSE: &str = "room.npz";

/// Colourful walls, two sources, one of them directional: every term of the ledger of a closed room is at work.
pub(crate) const SCENE: &str = r#"
name = "test room"
shoebox = [6.0, 5.0, 4.0]
duration_s = 0.6
[bands]
center_frequencies_hz = [250, 500, 1000, 2000, 4000]
[materials.walls]
absorption = [0.2, 0.9, 0.05, 0.5, 0.3]
scattering = [0.5, 0.05, 0.9, 0.3, 0.1]
[materials.z0]
absorption = 0.4
scattering = 0.2
[[sources]]
name = "stage"
position = [1.5, 1.2, 1.3]
directivity = "cardioid"
aim = [1.0, 0.0, 0.0]
[[sources]]
name = "pit"
position = [4.5, 3.2, 2.3]
[[receivers]]
name = "seat 12"
position = [4.0, 2.0, 1.2]
"#;

fn traced(options: &[&str]) -> TestFolder {
    let folder = TestFolder::with(SCENE);
    trace(&folder, MAP, options);
    folder
}

/// An exponential decay at one receiver in one band.
pub(crate) fn render(folder: &TestFolder) {
    let edges: Vec<f64> = (0..=1000).map(|edge| f64::from(edge) * 0.001).collect();
    let energy = edges.windows(2).map(|pair| (-10.0 * pair[0]).exp() - (-10.0 * pair[1]).exp()).collect();
    let response = Response {
        center_frequency_hz: vec![1000.0],
        time_edges_s: edges,
        receiver_names: vec!["seat 12".into()],
        receiver_positions: vec![[3.43, 0.0, 0.0]],
        receiver_directivities: Vec::new(),
        source_names: vec!["stage".into()],
        source_positions: vec![[0.0; 3]],
        source_power_level_db: vec![90.0],
        speed_of_sound: 343.0,
        characteristic_impedance: 413.0,
        direct_times_s: Vec::new(),
        energy,
        batches: None,
        missing: None,
        arrivals: Arrivals::default(),
        directions: None,
        provenance: Provenance {
            scene: Some("test room".to_owned()),
            map_tool_version: Some("0.1.0".to_owned()),
            ..Provenance::default()
        },
    };
    response
        .write(std::fs::File::create(folder.path(RESPONSE)).expect("a folder for tests"))
        .expect("written");
}

#[test]
fn the_version_has_revision_and_build() {
    let printed = analyze(&TestFolder::with(""), &["--version"]).done().out;
    let version = format!("sonel-analyze {}+{}.", env!("CARGO_PKG_VERSION"), sonel_renderer::REVISION);
    assert!(printed.starts_with(&version), "{printed}");
}

#[test]
fn the_longest_key_of_a_response_has_a_blank_behind_it() {
    let folder = TestFolder::with(SCENE);
    render(&folder);
    let text = analyze(&folder, &["inspect", RESPONSE]).done().out;
    assert!(text.contains("map_tool_version \"0.1.0\"") && text.contains("1 source, 1 receiver"), "{text}");
}

fn inspected(folder: &TestFolder) -> Value {
    serde_json::from_str(&analyze(folder, &["inspect", "--json", MAP]).done().out).expect("JSON")
}

#[test]
fn the_ledger_of_every_kind_of_map_is_found_in_its_paths() {
    for options in [
        &["--packets", "3000"][..],
        &["--packets", "1013", "--survival", "0"],
        &["--packets", "3000", "--shard", "2/3"],
    ] {
        let ended = analyze(&traced(options), &["verify", MAP]).done();
        assert!(
            ended.out.contains("agrees with the paths") && ended.err.is_empty(),
            "{options:?}: {ended:?}"
        );
    }
}

#[test]
fn the_ledger_of_a_paper_map_is_found_in_its_paths() {
    let folder = TestFolder::with(&SCENE.replace("cardioid", "omni"));
    trace(&folder, MAP, &["--packets", "700", "--mode", "paper"]);
    let ended = analyze(&folder, &["verify", MAP]).done();
    assert!(ended.out.contains("agrees with the paths") && ended.err.is_empty(), "{ended:?}");
}

#[test]
fn deposits_add_up_to_the_ledger() {
    let folder = traced(&["--packets", "2000"]);
    let json = inspected(&folder);
    assert_eq!((json["kind"].as_str(), json["emitted"].as_u64()), (Some("sonelmap"), Some(4000)));
    for (band, balance) in json["ledger"].as_array().unwrap().iter().enumerate() {
        let absorbed = balance["absorbed"].as_f64().unwrap() * 2.0;
        for listing in ["surfaces", "orders"] {
            let sum: f64 = json[listing]
                .as_array()
                .unwrap()
                .iter()
                .map(|deposit| deposit["absorbed_energy"][band].as_f64().unwrap())
                .sum();
            assert!((sum / absorbed - 1.0).abs() < 1e-9, "{listing} band {band}: {sum} not {absorbed}");
        }
        // The energy that leaves a source first arrives unreflected.
        let first = json["orders"][0]["incident_energy"][band].as_f64().unwrap();
        assert!((first - 2.0).abs() < 0.05, "{first}");
    }
    let hits = |listing: &str| -> u64 {
        json[listing].as_array().unwrap().iter().map(|deposit| deposit["hits"].as_u64().unwrap()).sum()
    };
    assert_eq!(hits("surfaces"), hits("orders"));
    let text = analyze(&folder, &["inspect", MAP]).done().out;
    assert!(text.contains("test room") && text.contains("residual"));
}

#[test]
fn inspect_lists_the_edges_that_diffract() {
    let text = analyze(&traced(&["--packets", "50"]), &["inspect", MAP]).done().out;
    assert!(text.contains("no edge diffracts"), "{text}");
    let folder = TestFolder::shipped("seed-room");
    trace(&folder, MAP, &["--packets", "50"]);
    let json = inspected(&folder);
    let edges = json["diffracting_edges"].as_array().unwrap();
    let mut lengths: Vec<f64> = edges.iter().map(|edge| edge["length_m"].as_f64().unwrap()).collect();
    lengths.sort_by(f64::total_cmp);
    assert_eq!(lengths, [20.0, 30.0]);
    for edge in edges {
        assert_eq!(
            (edge["kind"].as_str(), edge["wedge_angle_degrees"].as_f64()),
            (Some("free"), Some(360.0))
        );
        assert_eq!(edge["surfaces"], serde_json::json!([6]));
    }
}

#[test]
fn the_result_does_not_depend_on_the_threads() {
    let folder = traced(&["--packets", "3000"]);
    let runs = ["1", "2", "5"]
        .map(|threads| analyze(&folder, &["inspect", "--json", "--threads", threads, MAP]).done().out);
    assert!(!runs[0].is_empty() && runs[0] == runs[1] && runs[1] == runs[2]);
}

#[test]
fn damaged_maps_are_named_and_refused() {
    let folder = traced(&["--packets", "500"]);
    let sound = folder.bytes(MAP);
    let mut damages: Vec<Vec<u8>> = (0..20).map(|at| sound[..sound.len() * at / 20].to_vec()).collect();
    for at in (0..sound.len()).step_by(sound.len() / 40) {
        let mut flipped = sound.clone();
        flipped[at] ^= 0x40;
        damages.push(flipped);
    }
    for damaged in damages {
        folder.write(MAP, damaged);
        for command in ["verify", "inspect"] {
            let err = analyze(&folder, &[command, "--quiet", MAP]).refused();
            assert!(err.starts_with("error: ") && err.contains(MAP), "{command}: {err}");
        }
    }
}

#[test]
fn foreign_and_missing_files_are_named_and_refused() {
    let folder = TestFolder::with(SCENE);
    folder.write("notes.txt", "no map at all");
    for command in ["parameters", "inspect", "verify"] {
        for file in ["notes.txt", "missing.npz", &*folder.folder().to_string_lossy()] {
            let err = analyze(&folder, &[command, file]).refused();
            assert!(err.contains(file), "{command}: {err}");
            assert_eq!(err.lines().count(), 1, "one message: {err}");
        }
    }
}

/// A program that opened a pipe would wait for a writer that never comes.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_named_and_refused_at_once() {
    let folder = TestFolder::with(SCENE);
    folder.pipe("pipe.sonelmap");
    for command in [&["parameters"][..], &["inspect"], &["verify"], &["diff", "/dev/null"]] {
        for file in ["pipe.sonelmap", "/dev/null", "."] {
            let err = analyze(&folder, &[command, &[file]].concat()).refused();
            assert!(err.contains("not a regular file"), "{command:?}: {err}");
        }
    }
}

/// A decay of 0.5 s as a comb of clicks, which has the same energy in every bin of 10 ms but for its decay: T20 and T30 are exact to the
/// width of a click's octave.
#[test]
fn a_measured_impulse_response_is_read_like_a_response() {
    let folder = TestFolder::with(SCENE);
    let sample = |at: usize| match at % 40 {
        0 => (-6.907_755_3 * at as f64 / 8000.0).exp() as f32,
        _ => 0.0,
    };
    let samples = [vec![0.0; 800], (0..24_000).map(sample).collect()].concat();
    let recording = sonel_sound::Recording { sample_rate_hz: 16_000, channels: vec![samples] };
    recording.write(std::fs::File::create(folder.path("seat 12.wav")).unwrap()).unwrap();
    let csv = analyze(&folder, &["parameters", "--format", "csv", "seat 12.wav"]).done().out;
    let row = csv.lines().find(|line| line.contains("2000,t30_s")).expect("a row").to_owned();
    assert!(
        row.starts_with(",seat 12,2000,t30_s,0.49") || row.starts_with(",seat 12,2000,t30_s,0.50"),
        "{row}"
    );
    assert!(csv.lines().any(|line| line.contains("level_db") && line.contains("not calibrated")));
    analyze(&folder, &["plot", "seat 12.wav", "--what", "decay", "--receiver", "any", "-o", "m.svg"]).done();
    render(&folder);
    let beside = analyze(&folder, &["parameters", RESPONSE, "seat 12.wav", "--format", "csv"]).done().out;
    assert!(beside.contains("stage,seat 12,2000,t30_s,seat 12,"), "{beside}");
    let noisy = analyze(&folder, &["parameters", "seat 12.wav", "--noise", "NR-35"]).done().out;
    assert!(noisy.contains("speech transmission index, with noise: – ["), "{noisy}");
    assert!(noisy.contains("] a single measurement has no interval"), "{noisy}");
}

#[test]
fn a_response_is_read_in_every_format() {
    let folder = TestFolder::with(SCENE);
    render(&folder);
    let printed = |options: &[&str]| analyze(&folder, &[options, &[RESPONSE]].concat()).done().out;
    let table = printed(&["parameters"]);
    assert!(table.starts_with("test room: source \"stage\" at receiver \"seat 12\""), "{table}");
    // Its head, speech, the A-weighted level, two echo criteria, and the parameters of one band.
    assert_eq!(
        printed(&["parameters", "--format", "csv"]).lines().count(),
        5 + sonel_analysis::Parameter::ALL.len()
    );
    let json: Value = serde_json::from_str(&printed(&["parameters", "--format", "json"])).unwrap();
    let t30 = &json["receivers"][0]["bands"][0]["t30_s"]["value"];
    // 60 dB at 10 nepers of energy a second.
    assert!((t30.as_f64().unwrap() - 6.0 * std::f64::consts::LN_10 / 10.0).abs() < 1e-6, "{t30}");
    assert!(printed(&["inspect"]).contains("test room"));
}

#[test]
fn seats_pass_fail_or_are_undecided() {
    let folder = TestFolder::with(SCENE);
    render(&folder);
    let printed = |options: &[&str]| {
        analyze(&folder, &[&["parameters", RESPONSE, "--mean"], options].concat()).done().out
    };
    let targets = ["--target", "t30=1.4s±10%", "--target", "t30<=1.2s"];
    let table = printed(&targets);
    assert!(table.contains("mean over 1 receiver\n"), "{table}");
    let json: Value =
        serde_json::from_str(&printed(&[&targets[..], &["--format", "json"]].concat())).unwrap();
    let mean = &json["means"][0]["bands"][0]["t30_s"]["value"];
    assert!((mean.as_f64().unwrap() - 6.0 * std::f64::consts::LN_10 / 10.0).abs() < 1e-6, "{mean}");
    let [met, missed] = [0, 1].map(|at| &json["targets"][at]);
    // One value, of which nothing is decided without an interval.
    for target in [met, missed] {
        let counts = ["pass", "fail", "undecided", "without_value"].map(|key| target[key].as_u64().unwrap());
        assert_eq!(counts, [0, 0, 1, 0], "{target:#}");
    }
    let excluded = printed(&["--target", "din18041-a4"]);
    assert!(excluded.contains("target din18041-a4, source \"stage\": does not apply: "), "{excluded}");
    assert!((met["range"][0].as_f64().unwrap() - 1.26).abs() < 1e-9, "{met:#}");
    assert!(missed["range"][0].as_f64().is_none_or(|low| low == 0.0), "{missed:#}");
    analyze(&folder, &["parameters", RESPONSE, "--target", "t30=1s±5%", "--format", "csv"]).refused();
}

#[test]
fn bad_options_are_errors_and_help_has_an_example() {
    let folder = TestFolder::with(SCENE);
    for options in [["--format", "xml"], ["--threads", "0"]] {
        analyze(&folder, &["parameters", options[0], options[1], "nowhere.npz"]).refused();
    }
    for command in ["parameters", "inspect", "verify", "plot", "open-plan", "iacc"] {
        assert!(analyze(&folder, &[command, "--help"]).done().out.contains("Example"), "{command}");
    }
    assert!(analyze(&folder, &["--help"]).done().out.contains("Example:"));
}

#[test]
fn a_line_of_workstations_says_what_it_lacks() {
    let folder = TestFolder::with(SCENE);
    render(&folder);
    let noise = "42,38,35,32,28,24,20";
    let line = |options: &[&str]| analyze(&folder, &[&["open-plan", RESPONSE], options].concat());
    assert!(line(&["--noise", "42,38"]).refused().contains("seven levels"));
    assert!(line(&["--noise", "42,38,35,32,28,24,2000"]).refused().contains("2000 dB is outside"));
    assert!(line(&["--noise", noise, "--receiver", "desk"]).refused().contains("it has \"seat 12\""));
    let twice = line(&["--noise", noise, "--receiver", "seat 12", "--receiver", "seat 12"]).refused();
    assert!(twice.contains("\"seat 12\" is named twice"), "{twice}");
    let found: Value = serde_json::from_str(&line(&["--noise", noise, "--json"]).done().out).expect("JSON");
    assert!((found["places"][0]["distance_m"].as_f64().expect("a distance") - 3.43).abs() < 1e-12);
    let reason = found["places"][0]["speech_level_db"]["reason"].as_str().expect("a reason");
    assert!(reason.contains("125 Hz, 250 Hz"), "{reason}");
    assert!(line(&["--noise", noise]).done().out.contains("rD [m]: –"));
}

#[test]
fn a_comparison_needs_two_of_a_kind_with_batches() {
    let folder = traced(&["--packets", "500"]);
    render(&folder);
    assert!(analyze(&folder, &["diff", RESPONSE, MAP]).refused().contains("room.sonelmap is a map and"));
    assert!(analyze(&folder, &["diff", RESPONSE, RESPONSE]).refused().contains("no comparable parameter"));
}

/// `… | head`: the reader of stdout is gone before the first byte. That is neither a failure nor worth a word.
#[test]
fn a_closed_pipe_ends_the_program_quietly() {
    let folder = traced(&["--packets", "100"]);
    render(&folder);
    let run = |words: &[&str]| {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_sonel-analyze"));
        let command = command.current_dir(folder.folder()).args(words).stdout(writer);
        command.output().expect("a program that starts")
    };
    for words in [
        &["parameters", RESPONSE, "--format", "csv"][..],
        &["parameters", RESPONSE, "--format", "table"],
        &["inspect", MAP],
    ] {
        let ended = run(words);
        assert!(ended.status.success() && ended.stderr.is_empty(), "{words:?}: {ended:?}");
    }
    assert_eq!(run(&["inspect", "nowhere.npz"]).status.code(), Some(2), "other errors are told");
}

#[test]
fn what_a_command_reads_is_not_replaced() {
    let folder = TestFolder::with(SCENE);
    folder.write("dry.svg", "");
    let said = analyze(&folder, &["plot", "hall.npz", "--what", "map", "dry.svg", "-o", "dry.svg"]).refused();
    assert!(said.contains("is an input of this command"), "{said}");
}
