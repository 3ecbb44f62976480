//! A grid of energies over directions as a file gives it, and what is wrong with one.

use crate::obj::LineProblem;

/// Difference of levels in one direction from which on a note names it [dB]: rounding of files with one decimal.
pub(super) const SPREAD_DB: f64 = 0.1;

/// Energies by azimuth, polar angle and band, as of a [`sonel_acoustics::Balloon`].
pub(super) struct Grid {
    /// Numbers of azimuths, polar angles and bands.
    pub(super) shape: [usize; 3],
    /// As many energies; each band in a unit of its own.
    pub(super) energies: Vec<f64>,
    /// What is to be said about it.
    pub(super) notes: Vec<String>,
}

/// Everything wrong with a file.
pub(super) type Problems = Vec<LineProblem>;

/// A problem in a line, 0 for the file as a whole.
pub(super) fn problem(line: usize, message: impl Into<String>) -> LineProblem {
    LineProblem { line, message: message.into() }
}
