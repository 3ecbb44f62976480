//! The programs as a user runs them, from a scene file to a response.

mod bad_input;
mod choices;
mod comparison;
mod duration;
mod effects;
mod extend;
mod in_memory;
mod inputs;
mod pages;
mod parameters;
mod parts;
mod placement;
mod planning;
mod readers;
mod report;
mod reproducible;
mod revisions;
mod sound;
mod together;
mod uncertainty;
mod variants;

/// Damaged copies of every seed of a reader.
const COPIES: u64 = 60;

use clap::Parser;
use sonel_console::Outcome;
use sonel_echogram::Response;
use sonel_testkit::test_folder::TestFolder;

const SCENE: &str = r#"
name = "Two-coloured box"
shoebox = [5.0, 4.0, 3.0]
duration_s = 0.6

[bands]
center_frequencies_hz = [250, 500, 1000]

[air]
speed_of_sound = 343.0

[materials.walls]
absorption = [0.2, 0.3, 0.4]
scattering = 0.4

[materials.z0]
absorption = 0.5
scattering = [0.1, 0.5, 0.9]

[[sources]]
name = "speaker"
position = [1.0, 1.0, 1.5]

[[receivers]]
name = "listener"
position = [3.9, 2.8, 1.2]
"#;

/// A folder that holds a small scene.
fn test_folder() -> TestFolder {
    TestFolder::with(SCENE)
}

/// Runs `sonel-trace scene.toml -o MAP` with more `options`; what it prints to stdout.
fn trace(folder: &TestFolder, map: &str, options: &[&str]) -> anyhow::Result<String> {
    let line = folder.line("sonel-trace", "scene.toml", map, options);
    printed(|out| sonel_trace::run(&sonel_trace::Arguments::try_parse_from(line)?, out, &mut Vec::new()))
}

/// Runs `sonel-render MAP -o RESPONSE` with more `options`; what it prints to stdout.
fn render(folder: &TestFolder, map: &str, response: &str, options: &[&str]) -> anyhow::Result<String> {
    let line = folder.line("sonel-render", map, response, options);
    printed(|out| sonel_render::run(&sonel_render::Arguments::try_parse_from(line)?, out, &mut Vec::new()))
}

fn printed(program: impl FnOnce(&mut Vec<u8>) -> anyhow::Result<Outcome>) -> anyhow::Result<String> {
    let mut out = Vec::new();
    assert_eq!(program(&mut out)?, Outcome::Done);
    Ok(String::from_utf8(out)?)
}

/// Reads a response.
fn response(folder: &TestFolder, name: &str) -> Response {
    Response::read(std::io::Cursor::new(folder.bytes(name))).expect("a response just written")
}
