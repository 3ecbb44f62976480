//! A grid of energies over directions as a file gives it, and what is wrong with one.

use sonel_acoustics::energy_to_level_db;

use crate::problem::LineProblem;

/// Difference of levels in one direction from which on a note names it [dB]: rounding of files with one decimal.
const SPREAD_DB: f64 = 0.1;

/// Energies by azimuth, polar angle and band, as of a [`sonel_acoustics::Balloon`].
pub(super) struct Grid {
    /// Numbers of azimuths, polar angles and bands.
    pub(super) shape: [usize; 3],
    /// As many energies; each band in a unit of its own.
    pub(super) energies: Vec<f64>,
    /// What is to be said about it.
    pub(super) notes: Vec<String>,
}

/// Mean energies of some rows of one direction, by band, and the largest difference between them [dB].
pub(super) fn mean(rows: &[&[f64]]) -> (Vec<f64>, f64) {
    let mut spread = 0.0_f64;
    let of_band = |band: usize| {
        let energies = || rows.iter().map(|row| row[band]);
        let (low, high) = energies().fold((f64::INFINITY, 0.0_f64), |(l, h), e| (l.min(e), h.max(e)));
        if high > low {
            spread = spread.max(energy_to_level_db(high / low));
        }
        energies().sum::<f64>() / rows.len() as f64
    };
    ((0..rows[0].len()).map(of_band).collect(), spread)
}

/// What is said where levels of one direction, at this `place`, differ.
pub(super) fn spread_note(place: &str, spread_db: f64) -> Option<String> {
    let note = format!("levels {place} differ by up to {spread_db:.1} dB; their mean energy is used");
    (spread_db > SPREAD_DB).then_some(note)
}

/// Everything wrong with a file.
pub(super) type Problems = Vec<LineProblem>;
