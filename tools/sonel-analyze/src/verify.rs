//! `sonel-analyze verify`: checksums, structure, and the ledger recomputed from the paths.

use std::io::Write;

use sonel::analysis::survey::differences;
use sonel::map::Ledger;
use sonel_console::Outcome;

use crate::arguments::Verify;
use crate::open::{self, WalkedMap};

/// The ledger closes to rounding (docs/physics.md §3).
const LARGEST_RESIDUAL: f64 = 1e-9;
/// The sampling term must lie within this many standard deviations of zero (docs/physics.md §3).
const SAMPLING_SIGMAS: f64 = 4.0;

/// Checks a map. A damaged file is an error; sound paths with a wrong ledger are [`Outcome::Missed`].
///
/// # Errors
/// When the file cannot be read, is no map or is damaged, or `out` cannot be written.
pub(crate) fn run(arguments: &Verify, out: &mut dyn Write) -> anyhow::Result<Outcome> {
    let WalkedMap { map, survey, .. } = open::walked_map(&arguments.map)?;
    let (stored, scene) = (map.ledger(), &map.header().scene);
    writeln!(
        out,
        "{}: {} packets, {} sonels, {} bytes\nchecksums and structure: valid",
        arguments.map.display(),
        map.path_count(),
        map.sonel_count(),
        map.byte_length()
    )?;
    let mut problems = differences(&stored, &survey.ledger, scene.bands.nominal());
    problems.extend(imbalances(&stored, scene.bands.nominal()));
    if problems.is_empty() {
        writeln!(out, "energy ledger: closes to {:.1e} and agrees with the paths", stored.worst_residual())?;
        return Ok(Outcome::Done);
    }
    for problem in &problems {
        writeln!(out, "energy ledger: {problem}")?;
    }
    Ok(Outcome::Missed)
}

/// What is wrong with the ledger in themselves.
fn imbalances(ledger: &Ledger, center_frequencies_hz: &[f64]) -> Vec<String> {
    let mut sentences = Vec::new();
    for (frequency, band) in center_frequencies_hz.iter().zip(&ledger.bands) {
        let residual = band.relative_residual();
        if !residual.is_finite() || residual > LARGEST_RESIDUAL {
            sentences.push(format!("at {frequency} Hz it does not close, relative residual {residual:.1e}"));
        }
        let allowed = SAMPLING_SIGMAS * band.sampling_sigma() + LARGEST_RESIDUAL * band.emitted;
        if !band.sampling.is_finite() || band.sampling.abs() > allowed {
            sentences.push(format!(
                "at {frequency} Hz the sampling term {:.3e} is more than {SAMPLING_SIGMAS} standard deviations from 0",
                band.sampling
            ));
        }
    }
    sentences
}
