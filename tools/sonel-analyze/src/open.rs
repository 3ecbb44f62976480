//! Opens maps and responses; every error names the file.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use anyhow::{Context, bail};
use sonel::analysis::survey::{Survey, survey};
use sonel::echograms::Echograms;
use sonel::geometry::Geometry;
use sonel::map::SonelMap;
use sonel::names::place;
use sonel::sound::Recording;
use sonel_console::artifact::{self, Artifact};
use sonel_console::{input, spelled};

/// A map whose paths were checked and walked.
pub(crate) struct WalkedMap {
    /// The map.
    pub map: SonelMap,
    /// The walls of its scene.
    pub geometry: Geometry,
    /// What its paths say.
    pub survey: Survey,
}

/// What the file in `path` is, told by its first bytes.
///
/// # Errors
/// When it cannot be read or is neither.
pub(crate) fn kind(path: &Path) -> anyhow::Result<Artifact> {
    if let Some(kind) = artifact::kind(path)? {
        return Ok(kind);
    }
    bail!(
        "{} is neither a sonel map nor a response: pass a file written by sonel-trace or sonel-render",
        path.display()
    )
}

/// The response in `path`.
///
/// # Errors
/// When the file cannot be read or is no valid response.
pub(crate) fn response(path: &Path) -> anyhow::Result<Echograms> {
    Ok(response_with_room(path)?.into_echograms())
}

/// The response in `path`, with what its file states of the room.
///
/// # Errors
/// When the file cannot be read or is no valid response.
pub(crate) fn response_with_room(path: &Path) -> anyhow::Result<sonel::Response> {
    if kind(path)? == Artifact::Map {
        bail!("{} is a sonel map: make a response from it with sonel-render", path.display());
    }
    sonel::Response::open(path).map_err(spelled)
}

/// The map in `path`, its paths checked and walked.
///
/// # Errors
/// When the file cannot be read or is no valid map.
pub(crate) fn walked_map(path: &Path) -> anyhow::Result<WalkedMap> {
    let (map, geometry) = checked_map(path)?;
    let survey = survey(&map, &geometry);
    Ok(WalkedMap { map, geometry, survey })
}

/// The map in `path`, its paths checked, and the walls of its scene.
///
/// # Errors
/// When the file cannot be read or is no valid map.
pub(crate) fn checked_map(path: &Path) -> anyhow::Result<(SonelMap, Geometry)> {
    let named = || path.display().to_string();
    let (map, geometry) = map(path)?;
    map.check_surfaces(&geometry).with_context(named)?;
    map.check_paths(geometry.surfaces().len() as u32).with_context(named)?;
    Ok((map, geometry))
}

/// The map in `path`, its paths not checked yet, and the walls of its scene.
///
/// # Errors
/// When the file cannot be read or is no map.
pub(crate) fn map(path: &Path) -> anyhow::Result<(SonelMap, Geometry)> {
    let named = || path.display().to_string();
    let map = SonelMap::open(&file(path)?).with_context(named)?;
    let geometry = map.header().scene.geometry().with_context(named)?;
    Ok((map, geometry))
}

/// Index of the `wanted` one among `names` of sources or receivers of the response in `path`.
///
/// # Errors
/// When there is none, with those that there are.
pub(crate) fn place_of(path: &Path, what: &str, names: &[String], wanted: &str) -> anyhow::Result<usize> {
    let none = format!("{} has no {what}", path.display());
    Ok(place(names.iter().map(String::as_str), wanted, &none)?)
}

/// The sound in `path`.
///
/// # Errors
/// When the file cannot be read or is no WAV file.
pub(crate) fn recording(path: &Path) -> anyhow::Result<Recording> {
    Recording::read(BufReader::new(file(path)?)).with_context(|| path.display().to_string())
}

fn file(path: &Path) -> anyhow::Result<File> {
    input::open(path).with_context(|| format!("cannot open {}", path.display()))
}
