//! `merge` from outside: the run in one piece from its shards, and one clear message per problem.

use sonel_testkit::workshop::Workshop;

use crate::{analyze, trace};

const SCENE: &str = r#"
name = "test room"
shoebox = [6.0, 5.0, 4.0]
duration_s = 0.3
[bands]
center_frequencies_hz = [250, 500, 1000]
[materials.walls]
absorption = [0.2, 0.9, 0.05]
scattering = [0.5, 0.05, 0.9]
[[sources]]
name = "stage"
position = [1.5, 1.2, 1.3]
directivity = "cardioid"
aim = [1.0, 0.0, 0.0]
[[sources]]
name = "pit"
position = [4.5, 3.2, 2.3]
"#;

/// Joins `maps` to `output`: exit code and what stderr says.
fn merge(shop: &Workshop, maps: &[&str], output: &str) -> (Option<i32>, String) {
    let ended = analyze(shop, &[&["merge"], maps, &["-o", output]].concat());
    assert!(ended.out.is_empty());
    (ended.code, ended.err)
}

#[test]
fn shards_joined_are_the_run_in_one_piece_however_it_is_traced() {
    for options in [
        &["--sonels", "2600"][..],
        &["--sonels", "700", "--spectral", "per-band", "--batches", "7"],
        &["--sonels", "2049", "--survival", "1", "--effects", "none"],
    ] {
        let shop = Workshop::with(SCENE);
        trace(&shop, "whole.sonelmap", options);
        for index in ["1/3", "2/3", "3/3"] {
            trace(&shop, &format!("{}.sonelmap", &index[..1]), &[options, &["--shard", index]].concat());
        }
        let (code, log) = merge(&shop, &["3.sonelmap", "1.sonelmap", "2.sonelmap"], "joined.sonelmap");
        assert_eq!(code, Some(0), "{options:?}: {log}");
        assert!(log.contains("the whole run"), "{log}");
        assert!(shop.bytes("joined.sonelmap") == shop.bytes("whole.sonelmap"), "{options:?}");
        // The comparison sees more than lengths: another seed is another map.
        trace(&shop, "other.sonelmap", &[options, &["--seed", "77"]].concat());
        assert!(shop.bytes("joined.sonelmap") != shop.bytes("other.sonelmap"));
    }
}

#[test]
fn every_problem_is_a_line_and_older_outputs_stay() {
    let shop = Workshop::with(SCENE);
    let traced = |map: &str, options: &[&str]| trace(&shop, map, &[&["--sonels", "2k"], options].concat());
    traced("1.sonelmap", &["--shard", "1/3"]);
    traced("2.sonelmap", &["--shard", "2/3", "--seed", "9"]);
    traced("again.sonelmap", &["--shard", "2/3"]);
    shop.write("scene.toml", SCENE.replace("0.9, 0.05]", "0.8, 0.05]"));
    traced("3.sonelmap", &["--shard", "3/3", "--duration", "0.25"]);
    shop.write("joined.sonelmap", "older");
    let maps = ["1.sonelmap", "2.sonelmap", "again.sonelmap", "3.sonelmap", "missing.sonelmap"];
    let (code, log) = merge(&shop, &maps, "joined.sonelmap");
    assert_eq!(code, Some(2));
    for part in [
        "2.sonelmap: seed is 9, but 1 in",
        "3.sonelmap: scene file (its digest) is",
        "3.sonelmap: duration [s] is 0.25, but 0.3 in",
        "3.sonelmap: absorption of material \"walls\" is 0.2, 0.8, 0.05, but 0.2, 0.9, 0.05 in",
        "missing.sonelmap: ",
    ] {
        assert_eq!(log.matches(part).count(), 1, "{part}: {log}");
    }
    assert!(log.lines().count() == 5 && log.lines().all(|line| line.starts_with("error: ")), "{log}");
    let (code, log) = merge(&shop, &["1.sonelmap", "1.sonelmap"], "joined.sonelmap");
    assert_eq!(code, Some(2));
    assert!(log.contains("both hold emissions 0 to 511") && log.contains("(shards 2/3 to 3/3)"), "{log}");
    assert_eq!(shop.bytes("joined.sonelmap"), b"older");
}

#[test]
fn the_output_is_no_input() {
    let shop = Workshop::with(SCENE);
    for (map, index) in [("1.sonelmap", "1/2"), ("2.sonelmap", "2/2")] {
        trace(&shop, map, &["--sonels", "2k", "--shard", index]);
    }
    let before = shop.bytes("2.sonelmap");
    let (code, log) = merge(&shop, &["1.sonelmap", "2.sonelmap"], "2.sonelmap");
    assert!(code == Some(2) && log.contains("is an input of this command"), "{log}");
    assert!(before == shop.bytes("2.sonelmap"));
}

#[test]
fn a_single_shard_is_the_whole_run() {
    let shop = Workshop::with(SCENE);
    trace(&shop, "1.sonelmap", &["--sonels", "600", "--shard", "1/1"]);
    let (code, log) = merge(&shop, &["1.sonelmap"], "joined.sonelmap");
    assert_eq!(code, Some(0), "{log}");
    assert!(shop.bytes("1.sonelmap") == shop.bytes("joined.sonelmap"));
    let (code, _) = merge(&shop, &[], "nothing.sonelmap");
    assert_eq!(code, Some(2));
    assert!(!shop.path("nothing.sonelmap").exists());
}

#[test]
fn a_damaged_shard_leaves_no_output() {
    let shop = Workshop::with(SCENE);
    for (map, index) in [("1.sonelmap", "1/2"), ("2.sonelmap", "2/2")] {
        trace(&shop, map, &["--sonels", "2k", "--shard", index]);
    }
    let mut damaged = shop.bytes("2.sonelmap");
    damaged[4000] ^= 4;
    shop.write("2.sonelmap", damaged);
    let (code, log) = merge(&shop, &["1.sonelmap", "2.sonelmap"], "joined.sonelmap");
    assert!(code == Some(2) && log.contains("2.sonelmap") && log.contains("damaged at byte"), "{log}");
    assert!(!shop.path("joined.sonelmap").exists());
    // No temporary file stays behind either.
    assert_eq!(shop.names().len(), 3);
}
