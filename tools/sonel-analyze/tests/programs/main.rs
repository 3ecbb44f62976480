//! The program from outside: what it prints, its exit codes, and what it says of bad files.

mod commands;
mod diff;
mod export;
mod image;
mod merge;
mod tradeoff;

use clap::Parser;
use sonel_testkit::workshop::{Ended, Workshop};

/// Traces the scene in the folder.
fn trace(shop: &Workshop, map: &str, options: &[&str]) {
    let arguments = sonel_trace::Arguments::parse_from(shop.line("sonel-trace", "scene.toml", map, options));
    sonel_trace::run(&arguments, &mut std::io::sink(), &mut std::io::sink()).expect("a sound scene");
}

/// Runs `sonel-analyze` with `words` in the folder.
fn analyze(shop: &Workshop, words: &[&str]) -> Ended {
    shop.run(env!("CARGO_BIN_EXE_sonel-analyze"), words)
}
