//! Every command without a reader of what it prints, or on a full disk.
#![cfg(target_os = "linux")]

use clap::{CommandFactory, Parser};
use sonel_testkit::broken_streams::faults;
use sonel_testkit::test_folder::TestFolder;

use crate::{SCENE, analyze, trace};

/// Command lines of all commands, and help. That of `tradeoff` states how long it took.
const LINES: [&str; 22] = [
    "--help",
    "--version",
    "parameters --help",
    "parameters a.npz",
    "parameters a.npz --target c80<=-99dB",
    "open-plan a.npz -o out/line.svg --noise NR-35",
    "inspect a.sonelmap --json",
    "inspect a.npz",
    "verify a.sonelmap",
    "merge 1.sonelmap 2.sonelmap -o out/x.sonelmap",
    "export a.sonelmap -o out/x.csv",
    "export a.npz -o out/x.csv",
    "image a.sonelmap -o out/x.exr --eye 1,1,1 --look 5,4,2 --fov 80 --size 40x30",
    "diff a.npz b.npz",
    "diff a.sonelmap a.sonelmap --json",
    "sensitivity a.sonelmap --receiver seat=3,3,1.2",
    "plot a.npz -o out/x.svg",
    "report a.npz a.sonelmap -o out/x.html --noise NR-35",
    "auralise a.npz -o out/sounds",
    "auralise a.npz b.npz --recording sounds/1-stage_~left_1-seat.wav -o out/sounds",
    "iacc sounds/1-stage_~left_1-seat_binaural.wav",
    "tradeoff one.toml -o out/study --packets 64 --repeats 2",
];

fn folder() -> TestFolder {
    let folder = TestFolder::with(SCENE);
    let (one, _) = SCENE.rsplit_once("[[sources]]").expect("two sources");
    folder.write("one.toml", format!("{one}[[receivers]]\nposition = [3.0, 3.0, 1.2]\n"));
    let head = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/seeds/sofa/contiguous.sofa");
    std::fs::copy(head, folder.path("head.sofa")).expect("a seed");
    for (map, options) in [
        ("a.sonelmap", &["--packets", "500"][..]),
        ("b.sonelmap", &["--packets", "400"]),
        ("1.sonelmap", &["--packets", "500", "--shard", "1/2"]),
        ("2.sonelmap", &["--packets", "500", "--shard", "2/2"]),
    ] {
        trace(&folder, map, options);
    }
    let sounds = folder.path("sounds").display().to_string();
    let head = folder.path("head.sofa").display().to_string();
    for (map, response, options) in [
        ("a.sonelmap", "a.npz", &["--wav", sounds.as_str(), "--hrtf", head.as_str()][..]),
        ("b.sonelmap", "b.npz", &[]),
    ] {
        let line = folder.line("sonel-render", map, response, &["--receiver", "seat=3,3,1.2"]);
        let line = line.into_iter().chain(options.iter().map(|&option| option.to_owned()));
        let arguments = sonel_render::Arguments::parse_from(line);
        sonel_render::run(&arguments, &mut std::io::sink(), &mut std::io::sink()).expect("a response");
    }
    folder
}

#[test]
fn no_command_ends_well_without_what_it_was_asked_for() {
    for command in sonel_analyze::Arguments::command().get_subcommands() {
        let name = command.get_name();
        assert!(LINES.iter().any(|line| line.split(' ').next() == Some(name)), "{name} has no line");
    }
    let folder = folder();
    for (target, code) in [("c80<=-99dB", 1), ("c80<=99dB", 0), ("c80>=99dB", 1)] {
        for command in [&["parameters", "a.npz"][..], &["report", "a.npz", "-o", "page.html"]] {
            let line = [command, &["--target", target]].concat();
            assert_eq!(analyze(&folder, &line).code, Some(code), "{line:?}");
        }
    }
    let faults_of = |line: &&str| {
        let line = format!("{} {line}", env!("CARGO_BIN_EXE_sonel-analyze"));
        faults(&folder, &line, line.contains("tradeoff"))
    };
    let faults: Vec<String> = LINES.iter().flat_map(faults_of).collect();
    assert!(faults.is_empty(), "{faults:#?}");
}
