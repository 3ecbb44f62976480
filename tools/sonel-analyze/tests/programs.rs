//! The program from outside: what it prints, its exit codes, and what it says of bad files.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use clap::Parser;
use serde_json::Value;
use sonel_echogram::{Arrivals, Response};
use tempfile::TempDir;

/// Colourful walls, two sources, one of them directional: every term of the books of a closed room is at work.
const SCENE: &str = r#"
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

fn traced(folder: &TempDir, options: &[&str]) -> PathBuf {
    traced_scene(folder, SCENE, options)
}

fn traced_scene(folder: &TempDir, text: &str, options: &[&str]) -> PathBuf {
    let (scene, map) = (folder.path().join("scene.toml"), folder.path().join("room.sonelmap"));
    std::fs::write(&scene, text).expect("a folder for tests");
    let mut words =
        vec!["sonel-trace", scene.to_str().expect("plain"), "-o", map.to_str().expect("plain"), "--quiet"];
    words.extend(options);
    let arguments = sonel_trace::Arguments::parse_from(words);
    sonel_trace::run(&arguments, &mut std::io::sink(), &mut std::io::sink()).expect("a sound scene");
    map
}

/// An exponential decay at one receiver in one band.
fn rendered(folder: &TempDir) -> PathBuf {
    let edges: Vec<f64> = (0..=1000).map(|edge| f64::from(edge) * 0.001).collect();
    let energy = edges.windows(2).map(|pair| (-10.0 * pair[0]).exp() - (-10.0 * pair[1]).exp()).collect();
    let response = Response {
        center_frequency_hz: vec![1000.0],
        time_edges_s: edges,
        receiver_names: vec!["seat 12".into()],
        receiver_positions: vec![[3.43, 0.0, 0.0]],
        source_names: vec!["stage".into()],
        source_positions: vec![[0.0; 3]],
        source_power_level_db: vec![90.0],
        speed_of_sound: 343.0,
        characteristic_impedance: 413.0,
        energy,
        batches: None,
        arrivals: Arrivals::default(),
        metadata: serde_json::json!({ "scene": "test room" }),
    };
    let path = folder.path().join("room.npz");
    response.write(std::fs::File::create(&path).expect("a folder for tests")).expect("written");
    path
}

fn program(words: &[&str], file: &Path) -> assert_cmd::assert::Assert {
    Command::cargo_bin("sonel-analyze").expect("built").args(words).arg(file).assert()
}

fn printed(assert: &assert_cmd::assert::Assert) -> (String, String) {
    let output = assert.get_output();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("text");
    (text(&output.stdout), text(&output.stderr))
}

#[test]
fn the_ledger_of_every_kind_of_map_is_found_in_its_paths() {
    for options in [
        &["--sonels", "3000"][..],
        &["--sonels", "1013", "--survival", "0"],
        &["--sonels", "3000", "--shard", "2/3"],
    ] {
        let folder = TempDir::new().unwrap();
        let map = traced(&folder, options);
        let (out, err) = printed(&program(&["verify"], &map).success());
        assert!(out.contains("the paths say the same") && err.is_empty(), "{options:?}: {out}{err}");
    }
}

#[test]
fn the_ledger_of_a_paper_map_is_found_in_its_paths() {
    let folder = TempDir::new().unwrap();
    let omnidirectional = SCENE.replace("cardioid", "omni");
    let map = traced_scene(&folder, &omnidirectional, &["--sonels", "700", "--mode", "paper"]);
    let (out, err) = printed(&program(&["verify"], &map).success());
    assert!(out.contains("the paths say the same") && err.is_empty(), "{out}{err}");
}

#[test]
fn deposits_add_up_to_the_ledger() {
    let folder = TempDir::new().unwrap();
    let map = traced(&folder, &["--sonels", "2000"]);
    let (out, _) = printed(&program(&["inspect", "--json"], &map).success());
    let json: Value = serde_json::from_str(&out).unwrap();
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
    let (text, _) = printed(&program(&["inspect"], &map).success());
    assert!(text.contains("test room") && text.contains("residual"));
}

#[test]
fn inspect_lists_the_edges_that_diffract() {
    let folder = TempDir::new().unwrap();
    let map = traced(&folder, &["--sonels", "50"]);
    let (text, _) = printed(&program(&["inspect"], &map).success());
    assert!(text.contains("no edge diffracts"), "{text}");
    let screen = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/seed-room");
    std::fs::copy(screen.join("enclosure.obj"), folder.path().join("enclosure.obj")).unwrap();
    let map = traced_scene(
        &folder,
        &std::fs::read_to_string(screen.join("scene.toml")).unwrap(),
        &["--sonels", "50"],
    );
    let (out, _) = printed(&program(&["inspect", "--json"], &map).success());
    let json: Value = serde_json::from_str(&out).unwrap();
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
    let folder = TempDir::new().unwrap();
    let map = traced(&folder, &["--sonels", "3000"]);
    let runs = ["1", "2", "5"]
        .map(|threads| printed(&program(&["inspect", "--json", "--threads", threads], &map)).0);
    assert!(!runs[0].is_empty() && runs[0] == runs[1] && runs[1] == runs[2]);
}

#[test]
fn damaged_maps_are_named_and_refused() {
    let folder = TempDir::new().unwrap();
    let map = traced(&folder, &["--sonels", "500"]);
    let sound = std::fs::read(&map).unwrap();
    let mut damages: Vec<Vec<u8>> = (0..20).map(|at| sound[..sound.len() * at / 20].to_vec()).collect();
    for at in (0..sound.len()).step_by(sound.len() / 40) {
        let mut flipped = sound.clone();
        flipped[at] ^= 0x40;
        damages.push(flipped);
    }
    for damaged in damages {
        std::fs::write(&map, damaged).unwrap();
        for command in ["verify", "inspect"] {
            let assert = program(&[command, "--quiet"], &map);
            let code = assert.get_output().status.code();
            let (out, err) = printed(&assert);
            assert_eq!(code, Some(2), "{command}: {out}{err}");
            assert!(err.starts_with("error: ") && err.contains("room.sonelmap"), "{command}: {err}");
            assert!(out.is_empty() && !err.contains("panicked"), "{command}: {out}{err}");
        }
    }
}

#[test]
fn foreign_and_missing_files_are_named_and_refused() {
    let folder = TempDir::new().unwrap();
    let text = folder.path().join("notes.txt");
    std::fs::write(&text, "no map at all").unwrap();
    let missing = folder.path().join("missing.npz");
    for command in [&["parameters"][..], &["inspect"], &["verify"]] {
        for file in [&text, &missing, &folder.path().to_owned()] {
            let assert = program(command, file);
            let (out, err) = printed(&assert);
            assert_eq!(assert.get_output().status.code(), Some(2), "{command:?} {err}");
            assert!(out.is_empty() && err.contains(&*file.to_string_lossy()), "{command:?}: {err}");
            assert_eq!(err.lines().count(), 1, "one message: {err}");
        }
    }
}

/// A program that opened a pipe would wait for a writer that never comes.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_named_and_refused_at_once() {
    let folder = TempDir::new().unwrap();
    let pipe = folder.path().join("pipe.sonelmap");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for command in [&["parameters"][..], &["inspect"], &["verify"], &["diff", "/dev/null"]] {
        for file in [&pipe, Path::new("/dev/null"), folder.path()] {
            let assert = program(command, file);
            let (out, err) = printed(&assert);
            assert_eq!(assert.get_output().status.code(), Some(2), "{command:?} {err}");
            assert!(out.is_empty() && err.contains("no ordinary file"), "{command:?}: {err}");
        }
    }
}

#[test]
fn a_response_is_read_in_every_format() {
    let folder = TempDir::new().unwrap();
    let response = rendered(&folder);
    let (table, _) = printed(&program(&["parameters"], &response).success());
    assert!(table.starts_with("test room: source \"stage\" at receiver \"seat 12\""), "{table}");
    let (csv, _) = printed(&program(&["parameters", "--format", "csv"], &response).success());
    assert_eq!(csv.lines().count(), 11);
    let (json, _) = printed(&program(&["parameters", "--format", "json"], &response).success());
    let json: Value = serde_json::from_str(&json).unwrap();
    let t30 = &json["receivers"][0]["bands"][0]["t30_s"]["value"];
    // 60 dB at 10 nepers of energy a second.
    assert!((t30.as_f64().unwrap() - 6.0 * std::f64::consts::LN_10 / 10.0).abs() < 1e-6, "{t30}");
    let (inspected, _) = printed(&program(&["inspect"], &response).success());
    assert!(inspected.contains("test room"), "{inspected}");
}

#[test]
fn bad_options_are_errors_and_help_has_an_example() {
    let nowhere = Path::new("nowhere.npz");
    assert_eq!(program(&["parameters", "--format", "xml"], nowhere).get_output().status.code(), Some(2));
    assert_eq!(program(&["parameters", "--threads", "0"], nowhere).get_output().status.code(), Some(2));
    for words in [&["--help"][..], &["parameters", "--help"], &["inspect", "--help"], &["verify", "--help"]] {
        let (out, _) = printed(&program(words, nowhere).success());
        assert!(out.contains("Example:"), "{words:?}");
    }
}

#[test]
fn a_comparison_needs_two_of_a_kind_with_batches() {
    let folder = TempDir::new().unwrap();
    let (map, response) = (traced(&folder, &["--sonels", "500"]), rendered(&folder));
    let path = response.to_str().unwrap();
    let of_map = program(&["diff", path], &map);
    assert_eq!(of_map.get_output().status.code(), Some(2));
    assert!(printed(&of_map).1.contains("room.sonelmap is a map and"));
    let without_batches = program(&["diff", path], &response);
    assert_eq!(without_batches.get_output().status.code(), Some(2));
    assert!(printed(&without_batches).1.contains("no figure in common"));
}
