//! `sonel-analyze diff`: changes between two files, and differences beyond noise.

mod maps;
mod responses;

use std::io::Write;

use anyhow::bail;
use sonel_console::Outcome;

use crate::arguments::Diff;
use sonel_console::artifact::Artifact;

use crate::open;

/// Compares two maps or two responses; [`Outcome::Missed`] where they differ beyond noise.
///
/// # Errors
/// When a file is unusable, the two are of different kinds or have nothing in common, or `out` cannot be written.
pub(crate) fn run(arguments: &Diff, out: &mut dyn Write) -> anyhow::Result<Outcome> {
    let b = arguments.other();
    match (open::kind(&arguments.a)?, open::kind(b)?) {
        (Artifact::Map, _) | (_, Artifact::Map) if !arguments.between.is_empty() => {
            bail!("--between compares receivers: give responses, not maps")
        }
        (Artifact::Map, Artifact::Map) => maps::run(arguments, out),
        (Artifact::Response, Artifact::Response) => responses::run(arguments, out),
        (a, _) => {
            let (map, response) = match a {
                Artifact::Map => (arguments.a.as_path(), b),
                Artifact::Response => (b, arguments.a.as_path()),
            };
            bail!(
                "{} is a map and {} a response: compare two maps or two responses (sonel-render makes a response from a map)",
                map.display(),
                response.display()
            )
        }
    }
}
