//! Maps larger than memory: tracing, verifying, comparing and rendering hold a small part of a map at a time.
//!
//! The work runs in processes of their own under `ulimit -d`. It limits what a process writes for itself (heap, stacks,
//! private mappings), not pages of the map, which the kernel reads when they are touched and drops when it needs room.
//!
//! The test has maps of 0.31 GB in 144 MiB. Measured with two threads and 5 M packets in the seed room, 3.14 GB a map:
//!
//! | program | seconds | own memory | mapped pages |
//! |---|---|---|---|
//! | `sonel-trace` | 36 | 25 MB | 4 MB |
//! | `sonel-analyze verify` | 20 | 5 MB | 3.0 GB |
//! | `sonel-analyze diff`, two seeds | 17 | 10 MB | 6.0 GB |
//! | `sonel-render`, one receiver | 54 | 45 MB | 3.0 GB |
#![cfg(target_os = "linux")]

use std::path::PathBuf;
use std::process::{Command, Output};

use clap::Parser;
use sonel_map::SonelMap;

/// What a process may write for itself [KiB]: less than half of the map.
const LIMIT_KIB: u64 = 144 << 10;
/// Emissions of the seed room: 38 arrivals of 16 bytes each.
const PACKETS: &str = "500k";
/// Where the limited processes find their files.
const FOLDER: &str = "SONEL_ACCEPT_FOLDER";

fn limited(test: &str, folder: &std::path::Path) -> Output {
    let itself = std::env::current_exe().expect("a running test");
    let mut shell = Command::new("sh");
    shell.args(["-c", "ulimit -d $0 && exec \"$@\"", &LIMIT_KIB.to_string()]).arg(itself);
    shell.args(["--exact", test, "--ignored", "--nocapture"]).env(FOLDER, folder);
    shell.output().expect("a shell")
}

#[test]
fn a_map_larger_than_memory_is_traced_verified_compared_and_rendered() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let worked = limited("memory::all_programs", folder.path());
    let said =
        String::from_utf8_lossy(&worked.stdout).into_owned() + &String::from_utf8_lossy(&worked.stderr);
    assert!(worked.status.success() && said.contains("1 passed"), "{said}");
    let bytes = folder.path().join("a.sonelmap").metadata().expect("the map").len();
    println!("{bytes} bytes in {LIMIT_KIB} KiB");
    assert!(bytes > 2 * LIMIT_KIB * 1024, "the map is larger than the limit");
    // The sibling: whoever reads the whole map into memory is stopped by the limit.
    let greedy = limited("memory::the_whole_map_in_memory", folder.path());
    assert!(!greedy.status.success(), "the limit does not bind");
}

fn folder() -> PathBuf {
    PathBuf::from(std::env::var_os(FOLDER).expect("set by the test that limits"))
}

#[test]
#[ignore = "run under a limit by a_map_larger_than_memory_is_traced_verified_compared_and_rendered"]
fn all_programs() {
    let place = |name: &str| folder().join(name).display().to_string();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/seed-room/scene.toml");
    let (a, b, response) = (place("a.sonelmap"), place("b.sonelmap"), place("a.npz"));
    let mut out = Vec::new();
    let quiet = ["--quiet", "--threads", "2"];
    let first = ["sonel-trace", scene, "-o", &a, "--packets", PACKETS];
    let arguments = sonel_trace::Arguments::parse_from(first.iter().chain(&quiet));
    sonel_trace::run(&arguments, &mut out, &mut Vec::new()).expect("a map");
    // Threads are chosen once in a process.
    let second = ["sonel-trace", scene, "-o", &b, "--packets", PACKETS, "--seed", "2", "--quiet"];
    sonel_trace::run(&sonel_trace::Arguments::parse_from(second), &mut out, &mut Vec::new()).expect("a map");
    for words in [&["sonel-analyze", "verify", &a][..], &["sonel-analyze", "diff", &a, &b]] {
        let arguments = sonel_analyze::Arguments::parse_from(words);
        let outcome = sonel_analyze::run(&arguments, &mut out, &mut Vec::new()).expect("sound maps");
        assert_eq!(outcome, sonel_console::Outcome::Done);
    }
    let rendered = ["sonel-render", &a, "-o", &response, "--quiet"];
    let arguments = sonel_render::Arguments::parse_from(rendered);
    sonel_render::run(&arguments, &mut out, &mut Vec::new()).expect("a response");
}

#[test]
#[ignore = "run under a limit by a_map_larger_than_memory_is_traced_verified_compared_and_rendered"]
fn the_whole_map_in_memory() {
    let bytes = std::fs::read(folder().join("a.sonelmap")).expect("the map fits");
    assert!(SonelMap::from_bytes(&bytes).is_ok());
}
