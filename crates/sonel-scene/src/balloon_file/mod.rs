//! Directivity of a source from a file (docs/formats/directivity.md): a table of levels, or SOFA.

mod grid;
mod sofa;
mod table;

use sonel_acoustics::{Balloon, BalloonError, Bands, energy_to_level_db};

use crate::SceneErrors;
use crate::problem::LineProblem;
use grid::Problems;

/// Endings of loudspeaker files that are not read: CLF and GLL (docs/decisions.md).
const NOT_READ: [&str; 4] = [".clf", ".cf1", ".cf2", ".gll"];

/// Reads the balloon of the file called `name`, for `bands`; with what is to be said about it.
///
/// # Errors
/// Every problem with its line.
pub fn load_balloon(name: &str, bytes: &[u8], bands: &Bands) -> Result<(Balloon, Vec<String>), SceneErrors> {
    read(name, bytes, bands).map_err(|problems| SceneErrors::of_file(name, problems))
}

pub(crate) fn read(name: &str, bytes: &[u8], bands: &Bands) -> Result<(Balloon, Vec<String>), Problems> {
    if NOT_READ.iter().any(|ending| has_ending(name, ending)) {
        let problem = "loudspeaker files in CLF or GLL are not read: export the balloon as .csv or .sofa (docs/formats/directivity.md) and name that file instead";
        return Err(vec![LineProblem::new(0, problem)]);
    }
    let is_sofa = has_ending(name, ".sofa");
    let grid = if is_sofa { sofa::read(bytes, bands)? } else { table::read(bytes, bands)? };
    let mut notes = grid.notes;
    let label = name.rsplit(['/', '\\']).next().unwrap_or(name);
    let balloon = Balloon::new(label, grid.shape, grid.energies).map_err(|error| match error {
        BalloonError::Silent(band) => {
            let line = usize::from(!is_sofa);
            vec![LineProblem::new(line, format!("band {} Hz: no direction has sound", bands.nominal()[band]))]
        }
        other => vec![LineProblem::new(0, other.to_string())],
    })?;
    notes.push(describe(&balloon, bands));
    Ok((balloon, notes))
}

fn describe(balloon: &Balloon, bands: &Bands) -> String {
    let [azimuths, polars, _] = balloon.shape();
    let index =
        |(band, hz): (usize, &f64)| format!("{:.1} dB at {hz} Hz", energy_to_level_db(balloon.on_axis(band)));
    let indices: Vec<String> = bands.nominal().iter().enumerate().map(index).collect();
    format!("{azimuths} azimuths, {polars} polar angles; directivity index {}", indices.join(", "))
}

/// Whether a value of `directivity` names a file, be it one that is not read.
#[must_use]
pub fn is_balloon_file(value: &str) -> bool {
    [".csv", ".sofa"].iter().chain(&NOT_READ).any(|ending| has_ending(value, ending))
}

fn has_ending(value: &str, ending: &str) -> bool {
    value.to_lowercase().ends_with(ending)
}
