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

#[test]
fn memory_that_is_not_there_is_told_with_a_remedy() {
    let folder = traced("500");
    // Echograms of half a million bins.
    let words = "room.sonelmap -o room.npz --quiet --grid 1:4:4,2,1.2 --bin 0.000001";
    for (threads, remedy) in [(1, "if memory is short"), (1000, "take fewer --threads")] {
        let render = format!("ulimit -v 400000; exec {PROGRAM} {words} --threads {threads}");
        let ended = Ended::of(Command::new("sh").current_dir(folder.folder()).args(["-c", &render]));
        assert_eq!(ended.code, Some(2), "{ended:?}");
        assert!(ended.err.contains(remedy), "{ended:?}");
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
