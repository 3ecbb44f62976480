//! `sonel-analyze merge`: joins shards of a run to its map, parts of a rendering to its response.

use std::fmt::Display;
use std::io::Write;
use std::path::PathBuf;

use sonel::echograms::join;
use sonel::map::{Merger, ShardRange};
use sonel_console::Outcome;
use sonel_console::artifact::Artifact;
use sonel_console::input;
use sonel_console::output::{Kind, Output};
use sonel_console::progress::Progress;
use sonel_console::quantity::counted;

use crate::arguments::Merge;
use crate::open;

/// Joins shards.
///
/// # Errors
/// Everything that speaks against joining them, or the output cannot be written.
pub(crate) fn run(arguments: &Merge, quiet: bool, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    match open::kind(&arguments.shards[0])? {
        Artifact::Map => join_maps(arguments, quiet, log),
        Artifact::Response => join_responses(arguments, log),
    }
}

fn join_responses(arguments: &Merge, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Merge { shards, output } = arguments;
    let part = |path: &PathBuf| Ok((path.display().to_string(), open::response(path)?));
    let parts: Vec<_> = shards.iter().map(part).collect::<anyhow::Result<_>>()?;
    let whole = join(parts).map_err(|problems| together(&problems))?;
    Output::create(output, Kind::RESPONSE, &[])?.write(|out| whole.write(out).map(drop))?;
    let (count, receivers) = (counted(shards.len(), "response"), counted(whole.receivers(), "receiver"));
    writeln!(log, "{count} joined, {receivers}; written to {}", output.display())?;
    Ok(Outcome::Done)
}

fn join_maps(arguments: &Merge, quiet: bool, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Merge { shards: maps, output } = arguments;
    let names: Vec<String> = maps.iter().map(|map| map.display().to_string()).collect();
    let mut open = |number: usize| input::open(&maps[number]);
    let merger = Merger::new(&names, &mut open).map_err(|problems| together(&problems))?;
    let (paths, ShardRange { index, count }) = (merger.path_count(), merger.header().shard);

    let target = Output::create(output, Kind::MAP, &[])?;
    let progress = Progress::begin("merging", quiet);
    let mut reach = |copied| progress.reach(copied as f64 / paths as f64);
    target.write(|out| merger.write(out, &mut open, &mut reach).map(drop))?;
    drop(progress);
    let what = if count == 1 { "the whole run".to_owned() } else { format!("shard {index} of {count}") };
    let count = counted(maps.len(), "map");
    writeln!(log, "{count} joined, {paths} paths: {what}; written to {}", output.display())?;
    Ok(Outcome::Done)
}

/// One message of all `problems`.
fn together<E: Display>(problems: &[E]) -> anyhow::Error {
    let problems: Vec<String> = problems.iter().map(ToString::to_string).collect();
    anyhow::Error::msg(problems.join("\nerror: "))
}
