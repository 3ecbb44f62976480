//! `sonel-analyze inspect`: type, provenance and content of a file.

mod edges;
pub mod map;
mod response;

use std::io::Write;

use sonel_console::Outcome;

use crate::arguments::Inspect;
use crate::open::{self, Artifact};

/// Prints what a map or a response holds.
///
/// # Errors
/// When the file cannot be read, is damaged or is neither, or `out` cannot be written.
pub fn run(arguments: &Inspect, out: &mut dyn Write) -> anyhow::Result<Outcome> {
    let (json, text) = match open::artifact(&arguments.file)? {
        Artifact::Response(response) => (response::json(&response), response::text(&response)),
        Artifact::Map(walked) => (map::json(&walked), map::text(&walked)),
    };
    if arguments.printed.is_json() {
        writeln!(out, "{json:#}")?;
    } else {
        write!(out, "{text}")?;
    }
    Ok(Outcome::Done)
}
