//! `material_files` and the key `library` of a material.

use super::{LibraryEntry, Octaves, read, shipped};
use crate::bands::BandChoice;
use crate::document::{Entry, Table};
use crate::formats::Open;
use crate::suggest::suggest;

/// Names listed where none is near the one asked for: two lines of a message.
const MOST_NAMES: usize = 12;

/// What materials are read with: the bands of a scene and its libraries, its own files, then the shipped one.
pub(crate) struct MaterialSources {
    pub(crate) bands: BandChoice,
    /// Entries of the scene's material files.
    entries: Vec<LibraryEntry>,
    /// Whether a file was not readable, so that a missing name means nothing.
    lacks_files: bool,
}

/// Values that a material takes from entries; its own keys override them.
#[derive(Default)]
pub(crate) struct Borrowed {
    pub(crate) absorption: Option<Vec<f64>>,
    pub(crate) scattering: Option<Vec<f64>>,
    pub(crate) source: Option<String>,
}

/// Reads `material_files`.
pub(crate) fn read_material_sources(
    document: &Table<'_>,
    bands: BandChoice,
    open: Open<'_>,
) -> MaterialSources {
    let mut sources = MaterialSources::shipped(bands);
    let paths = document.get("material_files").map_or(Vec::new(), |entry| entry.texts());
    for (path, entry) in paths {
        let found = entry.file(path, open).and_then(|bytes| entry.report.sound(path, read(path, &bytes)));
        sources.lacks_files |= found.is_none();
        sources.entries.extend(found.into_iter().flatten());
    }
    sources
}

impl MaterialSources {
    /// The shipped library alone.
    pub(crate) fn shipped(bands: BandChoice) -> Self {
        Self { bands, entries: Vec::new(), lacks_files: false }
    }

    fn all(&self) -> impl Iterator<Item = &LibraryEntry> {
        self.entries.iter().chain(shipped())
    }

    /// What `library` of a material brings: a name, or several whose later ones add what the earlier ones lack.
    pub(crate) fn borrow(&self, table: &Table<'_>) -> Borrowed {
        let bands = &self.bands;
        let mut borrowed = Borrowed::default();
        let names = table.get("library").map_or(Vec::new(), |entry| entry.texts());
        for (name, entry) in names {
            let Some(found) = self.all().find(|found| found.name == name) else {
                if !self.lacks_files {
                    entry.problem(&format!("no material `{name}`; {}", self.advice(name)));
                }
                borrowed.absorption.get_or_insert_with(|| vec![0.0; bands.bands.count()]);
                continue;
            };
            let is_own = |what: &str| {
                table.get(what).is_some() || (what == "scattering" && table.get("diffuse").is_some())
            };
            let mut said = format!("{}: library `{name}`, {} ({})", entry.path, found.text, found.source);
            let taken = [
                (&mut borrowed.absorption, &found.absorption, "absorption"),
                (&mut borrowed.scattering, &found.scattering, "scattering"),
            ];
            for (wanted, octaves, what) in taken {
                let Some(octaves) = octaves.as_ref().filter(|_| wanted.is_none() && !is_own(what)) else {
                    continue;
                };
                *wanted = Some(per_band(octaves, what, &entry, bands));
                let held = held_bands(octaves, bands);
                if !held.is_empty() {
                    said += &format!("; {what} held constant at {held} Hz");
                }
            }
            table.report.default(said);
            let source = borrowed.source.take().map_or(String::new(), |source| source + "; ");
            borrowed.source = Some(format!("{source}{name}: {}", found.source));
        }
        borrowed
    }

    fn advice(&self, name: &str) -> String {
        let words = [name.to_owned()];
        let mut alike: Vec<&str> =
            self.all().filter(|entry| entry.matches(&words)).map(|entry| entry.name.as_str()).collect();
        alike.sort_by_key(|alike| !alike.starts_with(name));
        if !alike.is_empty() {
            let more = if alike.len() > MOST_NAMES { ", …" } else { "" };
            return format!("matching: {}{more}", alike[..alike.len().min(MOST_NAMES)].join(", "));
        }
        let near = suggest(name, self.all().map(|entry| entry.name.as_str()));
        if near.starts_with("did you mean") {
            near
        } else {
            "search with `sonel-trace materials WORD`".to_owned()
        }
    }
}

/// A coefficient for every band; measured ones above 1 count as 1, with a warning.
fn per_band(octaves: &Octaves, what: &str, entry: &Entry<'_>, bands: &BandChoice) -> Vec<f64> {
    let centers = bands.bands.nominal();
    let values: Vec<f64> = centers.iter().map(|center| octaves.at(*center).0).collect();
    let above: Vec<String> = values
        .iter()
        .zip(centers)
        .filter(|(value, _)| **value > 1.0)
        .map(|(value, hz)| format!("{value} at {hz} Hz"))
        .collect();
    if !above.is_empty() {
        entry.report.warn(format!("{}: {what} above 1 is taken as 1: {}", entry.path, above.join(", ")));
    }
    values.into_iter().map(|value| value.min(1.0)).collect()
}

/// The bands whose value is held from a neighbouring octave.
fn held_bands(octaves: &Octaves, bands: &BandChoice) -> String {
    let centers = bands.bands.nominal().iter();
    let held: Vec<String> = centers.filter(|center| octaves.at(**center).1).map(f64::to_string).collect();
    held.join(", ")
}
