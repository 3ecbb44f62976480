//! The library half of `sonel-view`: a room, its map and its responses as a page, frozen in a file or served while one moves in it.

mod arguments;
mod files;
mod live;
mod page;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::bail;
use sonel_console::follower::Follower;
use sonel_console::heard::HeardArguments;
use sonel_console::output::{Kind, Output, has_ending};
use sonel_console::{Log, Outcome, speak_as, use_threads};

pub use arguments::{Arguments, HeadArguments};
use files::Files;
pub use page::Subject;

/// Runs the program: the address to `out`, everything else to `log`.
///
/// # Errors
/// When a file is unusable, or the output or the address cannot be had.
pub fn run(arguments: &Arguments, out: &mut dyn Write, log: &mut Log<'_>) -> anyhow::Result<Outcome> {
    speak_as::<Arguments>();
    use_threads(arguments.common.threads)?;
    let Arguments { files, output, heard, head, packets, common, .. } = arguments;
    match output {
        Some(output) => freeze(files, output, heard, head, *packets, common.quiet, log),
        None => live::serve(Files::open(files)?, arguments, out, log),
    }
}

/// Writes the page of `files` to `output`: missed where a response fails a target. A scene is traced with `packets`, a map without response rendered at the receivers of its scene.
///
/// # Errors
/// When a file is unusable, there is a map of another scene, uncertainty is given without the map of a response, or the output cannot be written.
pub fn freeze(
    files: &[PathBuf],
    output: &Path,
    heard: &HeardArguments,
    head: &HeadArguments,
    packets: Option<u64>,
    quiet: bool,
    log: &mut Log<'_>,
) -> anyhow::Result<Outcome> {
    if !has_ending(output, "html") {
        bail!("{} does not end in .html: the page is an HTML file", output.display());
    }
    let target = Output::create(output, Kind::PAGE, &[])?;
    let follower = Follower::new(quiet, log);
    let (mut subjects, maps) = Files::open(files)?.rendered(packets, heard, &follower)?;
    let uncertainty = &head.uncertainty;
    if uncertainty.is_given() {
        for subject in &mut subjects {
            let Some(map) = maps.iter().find(|map| subject.is_of(map.sonels())).or(maps.first()) else {
                bail!(
                    "--material-uncertainty needs the map that the responses were rendered from: give it, too"
                )
            };
            subject.attach_materials(uncertainty, map, heard, &follower)?;
        }
    }
    let pairs: usize = subjects.iter().map(page::Subject::pairs).sum();
    if pairs > page::MOST_PAIRS {
        let most = page::MOST_PAIRS;
        follower.line(&format!(
            "note: curves of the first {most} of {pairs} pairs of source and receiver; tables hold all"
        ))?;
    }
    let walls = maps.iter().map(|map| follower.result(map.walls())).collect::<Result<Vec<_>, _>>()?;
    let traced = maps.iter().zip(&walls).map(|(map, walls)| page::Traced { map: map.sonels(), walls });
    let page = page::Page::of_responses(&subjects, &traced.collect::<Vec<_>>(), head);
    let text = page.to_html();
    target.write(|out| out.write_all(text.as_bytes()))?;
    follower.line(&format!("{:.1} MB; written to {}", text.len() as f64 / 1e6, output.display()))?;
    Ok(if page.has_failed() { Outcome::Missed } else { Outcome::Done })
}
