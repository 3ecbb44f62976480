//! The program from outside: what it prints, its exit codes, and what it says of bad files.

mod commands;
mod diff;
mod export;
mod image;
mod merge;
mod plot;
mod tradeoff;

use clap::Parser;
use sonel_testkit::test_folder::{Ended, TestFolder};

/// Traces the scene in the folder.
fn trace(folder: &TestFolder, map: &str, options: &[&str]) {
    let arguments =
        sonel_trace::Arguments::parse_from(folder.line("sonel-trace", "scene.toml", map, options));
    sonel_trace::run(&arguments, &mut std::io::sink(), &mut std::io::sink()).expect("a sound scene");
}

/// Runs `sonel-analyze` with `words` in the folder.
fn analyze(folder: &TestFolder, words: &[&str]) -> Ended {
    folder.run(env!("CARGO_BIN_EXE_sonel-analyze"), words)
}
