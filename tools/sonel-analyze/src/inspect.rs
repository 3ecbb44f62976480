//! `sonel-analyze inspect`: type, provenance and content of a file.

mod edges;
pub(crate) mod map;
mod response;

use std::io::Write;

use sonel_console::Outcome;
use sonel_console::artifact::Artifact;

use crate::arguments::Inspect;
use crate::open;

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
