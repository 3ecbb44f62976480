//! `sonel-analyze merge`: shards of a run joined to its map.

use std::io::Write;

use anyhow::Context;
use sonel_console::Outcome;
use sonel_console::input;
use sonel_console::output::{Kind, Output};
use sonel_console::progress::{Audience, Progress};
use sonel_map::{MergeError, Merger, ShardRange};

use crate::arguments::Merge;

/// Joins shards.
///
/// # Errors
/// Everything that speaks against joining the maps, or the output cannot be written.
pub fn run(arguments: &Merge, quiet: bool, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Merge { maps, output } = arguments;
    let names: Vec<String> = maps.iter().map(|map| map.display().to_string()).collect();
    let mut open = |number: usize| input::open(&maps[number]);
    let merger = Merger::new(&names, &mut open).map_err(|problems| together(&problems))?;
    let (paths, ShardRange { index, count }) = (merger.path_count(), merger.header().shard);

    let mut target = Output::create(output, Kind::MAP, maps)?;
    let progress = Progress::begin("merging", paths, Audience::unless(quiet));
    let written = merger.write(target.writer(), &mut open, &mut |copied| progress.reach(copied));
    progress.end();
    written
        .map(drop)
        .with_context(|| format!("cannot write {}; an older file there is untouched", output.display()))?;
    target.publish()?;
    let what = if count == 1 { "the whole run".to_owned() } else { format!("shard {index} of {count}") };
    writeln!(log, "{} maps joined, {paths} paths: {what}; written to {}", maps.len(), output.display())?;
    Ok(Outcome::Done)
}

/// One message of all `problems`.
fn together(problems: &[MergeError]) -> anyhow::Error {
    let problems: Vec<String> = problems.iter().map(ToString::to_string).collect();
    anyhow::Error::msg(problems.join("\nerror: "))
}
