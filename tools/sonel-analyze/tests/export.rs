//! `export` from outside: every sonel once, with energies that add up to what `inspect` says of the same map.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use clap::Parser;
use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = r#"
name = "test room"
shoebox = [6.0, 5.0, 4.0]
duration_s = 0.2
[bands]
center_frequencies_hz = [250, 1000]
[materials.walls]
absorption = [0.2, 0.9]
scattering = [0.5, 0.05]
[[sources]]
name = "stage, left"
position = [1.5, 1.2, 1.3]
directivity = "cardioid"
aim = [1.0, 0.0, 0.0]
[[sources]]
name = "pit"
position = [4.5, 3.2, 2.3]
"#;

fn traced(folder: &TempDir, map: &str, options: &[&str]) -> PathBuf {
    let (scene, map) = (folder.path().join("scene.toml"), folder.path().join(map));
    std::fs::write(&scene, SCENE).expect("a folder for tests");
    let mut words = vec!["sonel-trace".as_ref(), scene.as_os_str(), "-o".as_ref(), map.as_os_str()];
    words.extend(options.iter().map(|option| Path::new(option).as_os_str()));
    let arguments = sonel_trace::Arguments::parse_from(words);
    sonel_trace::run(&arguments, &mut std::io::sink(), &mut std::io::sink()).expect("a sound scene");
    map
}

fn program(words: &[&str], files: &[&Path]) -> (Option<i32>, String, String) {
    let mut command = Command::cargo_bin("sonel-analyze").expect("built");
    let output = command.args(words).args(files).output().expect("a program that runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// Exports `map` to a file called `output`.
fn export(map: &Path, output: &str, options: &[&str]) -> Vec<u8> {
    let output = map.with_file_name(output);
    let (code, out, err) =
        program(&[&["export", "--quiet"], options, &["-o"]].concat(), &[output.as_path(), map]);
    assert_eq!((code, out.as_str(), err.as_str()), (Some(0), "", ""));
    std::fs::read(output).expect("a file that was written")
}

/// Rows of a CSV file as fields; names of this scene have no quotes inside.
fn rows(csv: &[u8]) -> Vec<Vec<String>> {
    let text = std::str::from_utf8(csv).expect("text").replace("\"stage, left\"", "stage left");
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn rows_add_up_to_what_inspect_says() {
    let folder = TempDir::new().unwrap();
    let map = traced(&folder, "a.sonelmap", &["--sonels", "1500"]);
    let rows = rows(&export(&map, "a.csv", &[]));
    let column = |name: &str| rows[0].iter().position(|field| field == name).unwrap();
    let (_, json, _) = program(&["inspect", "--json"], &[&map]);
    let json: Value = serde_json::from_str(&json).unwrap();
    for (listing, key) in [("surfaces", "surface"), ("orders", "order")] {
        for (index, deposit) in json[listing].as_array().unwrap().iter().enumerate() {
            let here: Vec<&Vec<String>> =
                rows[1..].iter().filter(|row| row[column(key)] == index.to_string()).collect();
            assert_eq!(deposit["hits"].as_u64(), Some(here.len() as u64), "{listing} {index}");
            for (band, energy) in ["energy_250_hz", "energy_1000_hz"].into_iter().enumerate() {
                let sum: f64 = here.iter().map(|row| row[column(energy)].parse::<f64>().unwrap()).sum();
                let said = deposit["incident_energy"][band].as_f64().unwrap();
                assert!((sum - said).abs() <= 1e-12 + 1e-9 * said, "{listing} {index}: {sum}, not {said}");
            }
        }
    }
    let sources: Vec<&str> = rows[1..].iter().map(|row| row[0].as_str()).collect();
    assert!(sources.contains(&"stage left") && sources.contains(&"pit"));
}

#[test]
fn shards_hold_the_sonels_of_the_run_once() {
    let folder = TempDir::new().unwrap();
    let options = |shard: &'static str| ["--sonels", "1500", "--shard", shard];
    let whole = rows(&export(&traced(&folder, "a.sonelmap", &options("1/1")), "a.csv", &[]));
    let mut parts: Vec<Vec<String>> = ["1/2", "2/2"]
        .into_iter()
        .flat_map(|shard| {
            rows(&export(&traced(&folder, "b.sonelmap", &options(shard)), "b.csv", &[])).split_off(1)
        })
        .collect();
    assert_ne!(parts, whole[1..], "the sources of a shard follow one another");
    parts.sort_by_key(|row| row[0] != "stage left");
    assert_eq!(parts, whole[1..]);
}

#[test]
fn exports_do_not_depend_on_the_threads() {
    let folder = TempDir::new().unwrap();
    let map = traced(&folder, "a.sonelmap", &["--sonels", "9k"]);
    for output in ["a.csv", "a.npz"] {
        let one = export(&map, output, &["--threads", "1"]);
        assert!(one.len() > 100_000 && one == export(&map, output, &["--threads", "3"]), "{output}");
    }
}

#[test]
fn other_endings_and_damaged_maps_are_refused_and_older_outputs_stay() {
    let folder = TempDir::new().unwrap();
    let map = traced(&folder, "a.sonelmap", &["--sonels", "600"]);
    let refused = |output: &str| {
        let output = folder.path().join(output);
        let (code, _, err) = program(&["export", "-o"], &[output.as_path(), map.as_path()]);
        assert_eq!(code, Some(2), "{err}");
        err
    };
    for output in ["a.json", "a", "a.csv.gz"] {
        assert!(refused(output).contains("neither in .csv nor in .npz"));
        assert!(!folder.path().join(output).exists());
    }
    let mut damaged = std::fs::read(&map).unwrap();
    damaged[5000] ^= 1;
    std::fs::write(&map, damaged).unwrap();
    for output in ["a.csv", "a.npz"] {
        std::fs::write(folder.path().join(output), "older").unwrap();
        assert!(refused(output).contains("damaged at byte"));
        assert_eq!(std::fs::read(folder.path().join(output)).unwrap(), b"older");
    }
}
