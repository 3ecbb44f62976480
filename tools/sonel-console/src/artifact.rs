//! Maps and responses: told by their first bytes, and whether they belong together.

use std::io::Read;
use std::path::Path;

use anyhow::{Context, bail};
use sonel::echograms::{Echograms, Provenance};
use sonel::map::hexadecimal;
use sonel::scenes::CompiledScene;

use crate::input;

/// How a map begins.
const MAP_MAGIC: &[u8] = b"SONELMAP";
/// How a numpy archive begins.
const ARCHIVE_MAGIC: &[u8] = b"PK";
/// How a WAV file begins.
const SOUND_MAGIC: &[u8] = b"RIFF";

/// A kind of file that programs pass on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Artifact {
    /// Map of sonel-trace.
    Map,
    /// Response of sonel-render, or a measured impulse response.
    Response,
}

/// The name of the file in `path` without its ending.
#[must_use]
pub fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// What the file in `path` is; [`None`] where it is neither.
///
/// # Errors
/// When it cannot be read.
pub fn kind(path: &Path) -> anyhow::Result<Option<Artifact>> {
    let mut start = Vec::new();
    let file = input::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    file.take(8).read_to_end(&mut start).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(match &start[..] {
        MAP_MAGIC => Some(Artifact::Map),
        // A measured impulse response is read as a response.
        start if start.starts_with(ARCHIVE_MAGIC) || start.starts_with(SOUND_MAGIC) => {
            Some(Artifact::Response)
        }
        _ => None,
    })
}

/// Checks that the first of the named `responses` was rendered from a map of one of the `scenes`, and warns of others that were not.
///
/// # Errors
/// When the first was not, or the warning cannot be given.
pub fn check_scene<'a>(
    responses: impl IntoIterator<Item = (&'a str, &'a Echograms)>,
    scenes: &[&CompiledScene],
    warn: &mut dyn FnMut(&str) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let is_of_scene = |response: &Echograms| {
        let Provenance { scene_digest, mesh_digest, .. } = &response.provenance;
        scenes.iter().any(|scene| {
            let digests = [&scene.digest, &scene.mesh_digest].map(|digest| Some(hexadecimal(digest)));
            [scene_digest, mesh_digest] == digests.each_ref()
        })
    };
    for (number, (name, response)) in responses.into_iter().enumerate() {
        match number {
            _ if is_of_scene(response) => {}
            0 => bail!("{name} is of another scene than the map: give the map that it was rendered from"),
            _ => warn(&format!("warning: {name} is of another scene than the map"))?,
        }
    }
    Ok(())
}
