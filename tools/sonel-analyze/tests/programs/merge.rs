//! `merge` from outside: the run in one piece from its shards, and one clear message per problem.

use sonel_testkit::test_folder::TestFolder;

use crate::{SCENE, analyze, trace};

/// Joins `maps` to `output`: exit code and what stderr says.
fn merge(folder: &TestFolder, maps: &[&str], output: &str) -> (Option<i32>, String) {
    let ended = analyze(folder, &[&["merge"], maps, &["-o", output]].concat());
    assert!(ended.out.is_empty());
    (ended.code, ended.err)
}

#[test]
fn shards_joined_are_the_run_in_one_piece_however_it_is_traced() {
    for options in [
        &["--packets", "2600"][..],
        &["--packets", "700", "--spectral", "per-band", "--batches", "7"],
        &["--packets", "2049", "--survival", "1", "--effects", "none"],
    ] {
        let folder = TestFolder::with(SCENE);
        trace(&folder, "whole.sonelmap", options);
        for index in ["1/3", "2/3", "3/3"] {
            trace(&folder, &format!("{}.sonelmap", &index[..1]), &[options, &["--shard", index]].concat());
        }
        let (code, log) = merge(&folder, &["3.sonelmap", "1.sonelmap", "2.sonelmap"], "joined.sonelmap");
        assert_eq!(code, Some(0), "{options:?}: {log}");
        assert!(log.contains("the whole run"), "{log}");
        assert!(folder.bytes("joined.sonelmap") == folder.bytes("whole.sonelmap"), "{options:?}");
        // The comparison sees more than lengths: another seed is another map.
        trace(&folder, "other.sonelmap", &[options, &["--seed", "77"]].concat());
        assert!(folder.bytes("joined.sonelmap") != folder.bytes("other.sonelmap"));
    }
}

#[test]
fn every_problem_is_a_line_and_older_outputs_stay() {
    let folder = TestFolder::with(SCENE);
    let traced = |map: &str, options: &[&str]| trace(&folder, map, &[&["--packets", "2k"], options].concat());
    traced("1.sonelmap", &["--shard", "1/3"]);
    traced("2.sonelmap", &["--shard", "2/3", "--seed", "9"]);
    traced("again.sonelmap", &["--shard", "2/3"]);
    folder.write("scene.toml", SCENE.replace("0.9]", "0.899]"));
    traced("3.sonelmap", &["--shard", "3/3", "--duration", "0.25"]);
    folder.write("joined.sonelmap", "older");
    let maps = ["1.sonelmap", "2.sonelmap", "again.sonelmap", "3.sonelmap", "missing.sonelmap"];
    let (code, log) = merge(&folder, &maps, "joined.sonelmap");
    assert_eq!(code, Some(2));
    for part in [
        "2.sonelmap: seed is 9, but 1 in",
        "3.sonelmap: scene file (its digest) is",
        "3.sonelmap: duration [s] is 0.25, but 0.2 in",
        "3.sonelmap: absorption of material \"walls\" is 0.2, 0.899, but 0.2, 0.9 in",
        "missing.sonelmap: ",
    ] {
        assert_eq!(log.matches(part).count(), 1, "{part}: {log}");
    }
    assert!(log.lines().count() == 5 && log.lines().all(|line| line.starts_with("error: ")), "{log}");
    let (code, log) = merge(&folder, &["1.sonelmap", "1.sonelmap"], "joined.sonelmap");
    assert_eq!(code, Some(2));
    assert!(log.contains("both hold emissions 0 to 511") && log.contains("(shards 2/3 to 3/3)"), "{log}");
    assert_eq!(folder.bytes("joined.sonelmap"), b"older");
}

#[test]
fn the_output_is_no_input() {
    let folder = TestFolder::with(SCENE);
    for (map, index) in [("1.sonelmap", "1/2"), ("2.sonelmap", "2/2")] {
        trace(&folder, map, &["--packets", "2k", "--shard", index]);
    }
    let before = folder.bytes("2.sonelmap");
    let (code, log) = merge(&folder, &["1.sonelmap", "2.sonelmap"], "2.sonelmap");
    assert!(code == Some(2) && log.contains("is an input of this command"), "{log}");
    assert!(before == folder.bytes("2.sonelmap"));
}

#[test]
fn a_single_shard_is_the_whole_run() {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "1.sonelmap", &["--packets", "600", "--shard", "1/1"]);
    let (code, log) = merge(&folder, &["1.sonelmap"], "joined.sonelmap");
    assert_eq!(code, Some(0), "{log}");
    assert!(folder.bytes("1.sonelmap") == folder.bytes("joined.sonelmap"));
    let (code, _) = merge(&folder, &[], "nothing.sonelmap");
    assert_eq!(code, Some(2));
    assert!(!folder.path("nothing.sonelmap").exists());
}

#[test]
fn a_damaged_shard_leaves_no_output() {
    let folder = TestFolder::with(SCENE);
    for (map, index) in [("1.sonelmap", "1/2"), ("2.sonelmap", "2/2")] {
        trace(&folder, map, &["--packets", "2k", "--shard", index]);
    }
    let mut damaged = folder.bytes("2.sonelmap");
    damaged[4000] ^= 4;
    folder.write("2.sonelmap", damaged);
    let (code, log) = merge(&folder, &["1.sonelmap", "2.sonelmap"], "joined.sonelmap");
    assert!(code == Some(2) && log.contains("2.sonelmap") && log.contains("damaged at byte"), "{log}");
    assert!(!folder.path("joined.sonelmap").exists());
    // No temporary file stays behind either.
    assert_eq!(folder.names().len(), 3);
}
