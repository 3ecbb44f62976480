//! `sonel-analyze inspect`: type, provenance and content of a file.

mod edges;
pub(crate) mod map;
mod response;

use std::fmt::Write as _;
use std::io::Write;

use sonel_console::Outcome;
use sonel_console::artifact::Artifact;

use crate::arguments::Inspect;
use crate::open;

/// Lines of listings of surfaces, orders and edges; JSON has all.
const LISTED: usize = 12;

/// Prints what a map or a response holds.
///
/// # Errors
/// When the file cannot be read, is damaged or is neither, or `out` cannot be written.
pub(crate) fn run(arguments: &Inspect, out: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Inspect { file, printed } = arguments;
    match open::kind(file)? {
        Artifact::Response => {
            let response = open::response(file)?;
            printed.print(out, || response::json(&response), || response::text(&response))?;
        }
        Artifact::Map => {
            let walked = open::walked_map(file)?;
            printed.print(out, || map::json(&walked), || map::text(&walked))?;
        }
    }
    Ok(Outcome::Done)
}

/// Says how many of `count` rows a listing leaves out.
fn omitted(text: &mut String, count: usize, what: &str) {
    if count > LISTED {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "           … and {} more {what}: --json lists all", count - LISTED);
    }
}
