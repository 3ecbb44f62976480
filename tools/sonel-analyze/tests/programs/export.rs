//! `export` from outside: every sonel once, with energies that add up to what `inspect` says of the same map.

use serde_json::Value;
use sonel_testkit::test_folder::TestFolder;

use crate::{SCENE, analyze, trace};

/// Exports `map` to a file called `output`.
fn export(folder: &TestFolder, map: &str, output: &str, options: &[&str]) -> Vec<u8> {
    let ended = analyze(folder, &[&["export", "--quiet", map, "-o", output], options].concat()).done();
    assert!(ended.out.is_empty() && ended.err.is_empty(), "{ended:?}");
    folder.bytes(output)
}

/// Rows of a CSV file as fields; names of this scene have no quotes inside.
fn rows(csv: &[u8]) -> Vec<Vec<String>> {
    let text = std::str::from_utf8(csv).expect("text").replace("\"stage, left\"", "stage left");
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn rows_add_up_to_what_inspect_says() {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "a.sonelmap", &["--packets", "1500"]);
    let rows = rows(&export(&folder, "a.sonelmap", "a.csv", &[]));
    let column = |name: &str| rows[0].iter().position(|field| field == name).unwrap();
    let json: Value =
        serde_json::from_str(&analyze(&folder, &["inspect", "--json", "a.sonelmap"]).done().out).unwrap();
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
    let folder = TestFolder::with(SCENE);
    let exported = |shard: &str| {
        trace(&folder, "a.sonelmap", &["--packets", "1500", "--shard", shard]);
        rows(&export(&folder, "a.sonelmap", "a.csv", &[]))
    };
    let whole = exported("1/1");
    let mut parts: Vec<Vec<String>> =
        ["1/2", "2/2"].into_iter().flat_map(|shard| exported(shard).split_off(1)).collect();
    assert_ne!(parts, whole[1..], "the sources of a shard follow one another");
    parts.sort_by_key(|row| row[0] != "stage left");
    assert_eq!(parts, whole[1..]);
}

#[test]
fn exports_do_not_depend_on_the_threads() {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "a.sonelmap", &["--packets", "2k"]);
    for output in ["a.csv", "a.npz"] {
        let one = export(&folder, "a.sonelmap", output, &["--threads", "1"]);
        assert!(
            one.len() > 100_000 && one == export(&folder, "a.sonelmap", output, &["--threads", "3"]),
            "{output}"
        );
    }
}

#[test]
fn other_endings_and_damaged_maps_are_refused_and_older_outputs_stay() {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "a.sonelmap", &["--packets", "600"]);
    let refused = |output: &str| analyze(&folder, &["export", "-o", output, "a.sonelmap"]).refused();
    for output in ["a.json", "a", "a.csv.gz"] {
        assert!(refused(output).contains("neither in .csv nor in .npz"));
        assert!(!folder.path(output).exists());
    }
    let mut damaged = folder.bytes("a.sonelmap");
    damaged[5000] ^= 1;
    folder.write("a.sonelmap", damaged);
    for output in ["a.csv", "a.npz"] {
        folder.write(output, "older");
        assert!(refused(output).contains("damaged at byte"));
        assert_eq!(folder.bytes(output), b"older");
    }
}

/// A limit on the size of files fails a write as a full disk does: one message, and nothing of the libraries' own.
#[cfg(unix)]
#[test]
fn a_full_disk_is_said_once() {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "a.sonelmap", &["--packets", "2k"]);
    for output in ["a.csv", "a.npz"] {
        let program = env!("CARGO_BIN_EXE_sonel-analyze");
        let script = "trap '' XFSZ; ulimit -f 100; exec \"$0\" export --quiet -o \"$1\" a.sonelmap";
        let said = folder.run("sh", &["-c", script, program, output]).refused();
        assert!(said.starts_with("error: cannot write ") && said.contains(output), "{said}");
        assert!(said.lines().count() == 1 && said.matches("(os error").count() == 1, "{said}");
        assert_eq!(folder.names(), ["a.sonelmap", "scene.toml"]);
    }
}
