//! The program from outside: what it prints, its exit codes, and what it says of bad files.

mod broken_streams;
mod commands;
mod diff;
mod export;
mod image;
mod merge;
mod plot;
mod tradeoff;

use clap::Parser;
use sonel_testkit::test_folder::{Ended, TestFolder};

/// A box of two colours of walls with two sources, one of them directional.
const SCENE: &str = r#"
name = "test room"
shoebox = [6.0, 5.0, 4.0]
duration_s = 0.2
[bands]
center_frequencies_hz = [250, 1000]
[materials.walls]
absorption = [0.2, 0.9]
scattering = [0.5, 0.05]
[[sources]]
name = "stage, left"
position = [1.5, 1.2, 1.3]
directivity = "cardioid"
aim = [1.0, 0.0, 0.0]
[[sources]]
name = "pit"
position = [4.5, 3.2, 2.3]
"#;

/// Traces the scene in the folder.
fn trace(folder: &TestFolder, map: &str, options: &[&str]) {
    let arguments =
        sonel_trace::Arguments::parse_from(folder.line("sonel-trace", "scene.toml", map, options));
    sonel_trace::run(&arguments, &mut std::io::sink(), &mut std::io::sink()).expect("a valid scene");
}

/// Runs `sonel-analyze` with `words` in the folder.
fn analyze(folder: &TestFolder, words: &[&str]) -> Ended {
    folder.run(env!("CARGO_BIN_EXE_sonel-analyze"), words)
}
