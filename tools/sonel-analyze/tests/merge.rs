//! `merge` from outside: the run in one piece from its shards, and one clear message per problem.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use clap::Parser;
use tempfile::TempDir;

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

struct Shop {
    folder: TempDir,
}

impl Shop {
    fn open() -> Self {
        let shop = Self { folder: TempDir::new().expect("a folder for tests") };
        std::fs::write(shop.path("scene.toml"), SCENE).expect("an empty folder");
        shop
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).expect("a file that was written")
    }

    fn trace(&self, map: &str, options: &[&str]) {
        let (scene, map) = (self.path("scene.toml"), self.path(map));
        let mut words = vec!["sonel-trace".as_ref(), scene.as_os_str(), "-o".as_ref(), map.as_os_str()];
        words.extend(options.iter().map(|option| Path::new(option).as_os_str()));
        let arguments = sonel_trace::Arguments::parse_from(words);
        sonel_trace::run(&arguments, &mut std::io::sink(), &mut std::io::sink()).expect("a sound scene");
    }

    /// Joins `maps` to `output`: exit code and what stderr says.
    fn merge(&self, maps: &[&str], output: &str) -> (Option<i32>, String) {
        let mut command = Command::cargo_bin("sonel-analyze").expect("built");
        command.arg("merge").args(maps.iter().map(|map| self.path(map))).arg("-o").arg(self.path(output));
        let output = command.output().expect("a program that runs");
        assert!(output.stdout.is_empty());
        (output.status.code(), String::from_utf8(output.stderr).expect("text"))
    }
}

#[test]
fn shards_joined_are_the_run_in_one_piece_however_it_is_traced() {
    for options in [
        &["--sonels", "2600"][..],
        &["--sonels", "700", "--spectral", "per-band", "--batches", "7"],
        &["--sonels", "2049", "--survival", "1", "--effects", "none"],
    ] {
        let shop = Shop::open();
        shop.trace("whole.sonelmap", options);
        for index in ["1/3", "2/3", "3/3"] {
            shop.trace(&format!("{}.sonelmap", &index[..1]), &[options, &["--shard", index]].concat());
        }
        let (code, log) = shop.merge(&["3.sonelmap", "1.sonelmap", "2.sonelmap"], "joined.sonelmap");
        assert_eq!(code, Some(0), "{options:?}: {log}");
        assert!(log.contains("the whole run"), "{log}");
        assert!(shop.bytes("joined.sonelmap") == shop.bytes("whole.sonelmap"), "{options:?}");
        // The comparison sees more than lengths: another seed is another map.
        shop.trace("other.sonelmap", &[options, &["--seed", "77"]].concat());
        assert!(shop.bytes("joined.sonelmap") != shop.bytes("other.sonelmap"));
    }
}

#[test]
fn every_problem_is_a_line_and_older_outputs_stay() {
    let shop = Shop::open();
    let traced = |map: &str, options: &[&str]| shop.trace(map, &[&["--sonels", "2k"], options].concat());
    traced("1.sonelmap", &["--shard", "1/3"]);
    traced("2.sonelmap", &["--shard", "2/3", "--seed", "9"]);
    traced("again.sonelmap", &["--shard", "2/3"]);
    std::fs::write(shop.path("scene.toml"), SCENE.replace("0.9, 0.05]", "0.8, 0.05]")).unwrap();
    traced("3.sonelmap", &["--shard", "3/3", "--duration", "0.25"]);
    std::fs::write(shop.path("joined.sonelmap"), "older").unwrap();
    let maps = ["1.sonelmap", "2.sonelmap", "again.sonelmap", "3.sonelmap", "missing.sonelmap"];
    let (code, log) = shop.merge(&maps, "joined.sonelmap");
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
    let (code, log) = shop.merge(&["1.sonelmap", "1.sonelmap"], "joined.sonelmap");
    assert_eq!(code, Some(2));
    assert!(log.contains("both hold emissions 0 to 511") && log.contains("(shards 2/3 to 3/3)"), "{log}");
    assert_eq!(shop.bytes("joined.sonelmap"), b"older");
}

#[test]
fn the_output_is_no_input() {
    let shop = Shop::open();
    for (map, index) in [("1.sonelmap", "1/2"), ("2.sonelmap", "2/2")] {
        shop.trace(map, &["--sonels", "2k", "--shard", index]);
    }
    let before = shop.bytes("2.sonelmap");
    let (code, log) = shop.merge(&["1.sonelmap", "2.sonelmap"], "2.sonelmap");
    assert!(code == Some(2) && log.contains("both input and output"), "{log}");
    assert!(before == shop.bytes("2.sonelmap"));
}

#[test]
fn a_single_map_is_nothing_to_join() {
    let shop = Shop::open();
    shop.trace("1.sonelmap", &["--sonels", "600"]);
    let (code, log) = shop.merge(&["1.sonelmap"], "joined.sonelmap");
    assert!(code == Some(2) && log.contains("give two maps or more"), "{log}");
    let (code, _) = shop.merge(&[], "joined.sonelmap");
    assert_eq!(code, Some(2));
    assert!(!shop.path("joined.sonelmap").exists());
}

#[test]
fn a_damaged_shard_leaves_no_output() {
    let shop = Shop::open();
    for (map, index) in [("1.sonelmap", "1/2"), ("2.sonelmap", "2/2")] {
        shop.trace(map, &["--sonels", "2k", "--shard", index]);
    }
    let mut damaged = shop.bytes("2.sonelmap");
    damaged[4000] ^= 4;
    std::fs::write(shop.path("2.sonelmap"), damaged).unwrap();
    let (code, log) = shop.merge(&["1.sonelmap", "2.sonelmap"], "joined.sonelmap");
    assert!(code == Some(2) && log.contains("2.sonelmap") && log.contains("damaged at byte"), "{log}");
    assert!(!shop.path("joined.sonelmap").exists());
    // No temporary file stays behind either.
    assert_eq!(std::fs::read_dir(shop.folder.path()).unwrap().count(), 3);
}
