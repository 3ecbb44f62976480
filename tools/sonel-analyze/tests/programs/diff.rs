//! `diff` of maps from outside: what it prints and its exit codes.

use serde_json::Value;
use sonel_testkit::test_folder::{Ended, TestFolder};

use crate::{analyze, trace};

const SCENE: &str = r#"
name = "test room"
shoebox = [6.0, 5.0, 4.0]
duration_s = 0.6
[bands]
center_frequencies_hz = [250, 500, 1000]
[materials.walls]
absorption = [0.2, 0.2, 0.3]
scattering = 0.5
[materials.z0]
absorption = 0.15
scattering = 0.5
[[sources]]
name = "stage"
position = [1.5, 1.2, 1.3]
"#;

fn diff_json(folder: &TestFolder, a: &str, b: &str) -> (Option<i32>, Value) {
    let Ended { code, out, err } = analyze(folder, &["diff", "--json", a, b]);
    (code, serde_json::from_str(&out).unwrap_or_else(|_| panic!("{out}{err}")))
}

#[test]
fn a_map_is_identical_to_itself() {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "a.sonelmap", &["--packets", "500"]);
    trace(&folder, "b.sonelmap", &["--packets", "500"]);
    let Ended { code, out, err } = analyze(&folder, &["diff", "a.sonelmap", "b.sonelmap"]);
    assert!(code == Some(0) && out.starts_with("identical") && err.is_empty(), "{out}{err}");
    let (code, json) = diff_json(&folder, "a.sonelmap", "b.sonelmap");
    assert!(code == Some(0) && json["identical"] == true && json["same"] == true, "{json}");
}

#[test]
fn seeds_sizes_and_shards_of_one_scene_are_the_same() {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "a.sonelmap", &["--packets", "8000"]);
    trace(&folder, "seed.sonelmap", &["--packets", "8000", "--seed", "2"]);
    trace(&folder, "small.sonelmap", &["--packets", "3000", "--seed", "3", "--batches", "8"]);
    trace(&folder, "shard.sonelmap", &["--packets", "12000", "--seed", "4", "--shard", "2/3"]);
    for other in ["seed.sonelmap", "small.sonelmap", "shard.sonelmap"] {
        let Ended { code, out, err } = analyze(&folder, &["diff", "a.sonelmap", other]);
        assert!(
            code == Some(0) && out.contains("same within noise") && err.is_empty(),
            "{other}: {out}{err}"
        );
        assert!(out.contains("changed: seed: 1 in A, "), "{out}");
    }
    let Ended { out, .. } = analyze(&folder, &["diff", "a.sonelmap", "shard.sonelmap"]);
    assert!(out.contains("changed: shard: 1 of 1 in A, 2 of 3 in B"), "{out}");
}

#[test]
fn a_change_is_said_found_and_located() {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "before.sonelmap", &["--packets", "20k"]);
    let after = SCENE.replace("absorption = 0.15", "absorption = [0.15, 0.15, 0.4]");
    folder.write("scene.toml", after);
    trace(&folder, "after.sonelmap", &["--packets", "20k", "--seed", "2"]);
    let Ended { code, out, .. } = analyze(&folder, &["diff", "before.sonelmap", "after.sonelmap"]);
    assert_eq!(code, Some(1), "{out}");
    assert!(
        out.contains("changed: absorption of material \"z0\": 0.15, 0.15, 0.15 in A, 0.15, 0.15, 0.4 in B")
    );
    assert!(out.contains("different: "), "{out}");
    let (code, json) = diff_json(&folder, "before.sonelmap", "after.sonelmap");
    assert!(code == Some(1) && json["same"] == false && json["kind"] == "sonelmap");
    let cells = json["cells"].as_array().unwrap();
    let differing: Vec<&Value> = cells.iter().filter(|cell| cell["differs"] == true).collect();
    assert!(!differing.is_empty());
    for cell in differing {
        assert_eq!(cell["center_frequency_hz"], serde_json::json!([1000.0]), "{cell}");
        assert!(cell["ratio_db"]["value"].as_f64().unwrap() < 0.0, "{cell}");
    }
    let significance = |cell: &Value| cell["significance"].as_f64().unwrap();
    assert!(cells.windows(2).all(|pair| significance(&pair[0]) >= significance(&pair[1])));
}

#[test]
fn maps_with_nothing_in_common_are_refused_with_the_reason() {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "a.sonelmap", &["--packets", "2000"]);
    let cases = [
        (SCENE.replace("\"stage\"", "\"pit\""), &["--packets", "2000"][..], "no source in common"),
        (
            SCENE.replace("[250, 500, 1000]", "[2000, 4000, 8000]"),
            &["--packets", "2000"],
            "no band in common",
        ),
        (SCENE.to_owned(), &["--packets", "2000", "--batches", "1"], "fewer than two batches"),
        (SCENE.to_owned(), &["--packets", "40", "--seed", "2"], "trace both with more packets"),
    ];
    for (scene, options, reason) in cases {
        folder.write("scene.toml", scene);
        trace(&folder, "b.sonelmap", options);
        let Ended { code, out, err } = analyze(&folder, &["diff", "a.sonelmap", "b.sonelmap"]);
        assert!(code == Some(2) && out.is_empty() && err.contains(reason), "{reason}: {out}{err}");
        assert!(err.contains("b.sonelmap"), "{err}");
    }
}

#[test]
fn a_damaged_map_is_named_even_if_the_other_has_its_digest() {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "a.sonelmap", &["--packets", "500"]);
    let mut bytes = folder.bytes("a.sonelmap");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    folder.write("b.sonelmap", bytes);
    let Ended { code, err, .. } = analyze(&folder, &["diff", "a.sonelmap", "b.sonelmap"]);
    assert!(code == Some(2) && err.contains("b.sonelmap"), "{err}");
}
