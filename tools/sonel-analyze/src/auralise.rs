//! `sonel-analyze auralise`: impulse responses of a stored response.

use std::io::Write;

use anyhow::Context;
use sonel_console::Outcome;
use sonel_console::output::publish;
use sonel_console::quantity::counted;
use sonel_render::SoundFiles;

use crate::arguments::Auralise;
use crate::open;

/// Writes the impulse responses of a response.
///
/// # Errors
/// When the response cannot be read, has no directions that are needed, or a file cannot be written.
pub(crate) fn run(arguments: &Auralise, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Auralise { response: path, sound, seed } = arguments;
    let response = open::response_with_room(path)?;
    let echograms = response.echograms();
    let [sources, receivers] =
        [&echograms.source_names, &echograms.receiver_names].map(|names| names.iter().map(String::as_str));
    let Some(files) = SoundFiles::of(sound, sources, receivers)? else { return Ok(Outcome::Done) };
    publish(files.complete(&response, *seed).with_context(|| path.display().to_string())?)?;
    let count = counted(files.count(), "impulse response");
    writeln!(log, "{count} written to {}", files.folder.display())?;
    Ok(Outcome::Done)
}
