//! Averages of a figure over bands (single numbers) and over receivers, with intervals.
//!
//! Values are averaged arithmetically. Figures of one response share their batches, so that their errors are correlated: the
//! average is read without each batch in turn and jackknifed like a figure itself. The interval is that of the average of these places and
//! bands, not the spread of a room.
//!
//! References: [ISO3382-1] table A.1 for the octaves of single numbers (docs/references.md).

use crate::figure::{Estimate, Figure, NoInterval, Unsupported};
use crate::jackknife;
use crate::parameter::Parameter;
use crate::receiver::ReceiverFigures;

/// Octaves of single numbers, nominal centres [Hz]: 500 and 1000 Hz.
pub const SINGLE_NUMBER_OCTAVES: [f64; 2] = [500.0, 1000.0];

/// Arithmetic mean of figures of one response.
///
/// # Errors
/// The first reason why one of them has no value, or [`Unsupported::NoEnergy`] where there is none at all.
pub fn average<'a>(figures: impl IntoIterator<Item = &'a Figure>) -> Figure {
    let estimates: Vec<&Estimate> =
        figures.into_iter().map(|figure| figure.as_ref().map_err(Clone::clone)).collect::<Result<_, _>>()?;
    let first = *estimates.first().ok_or(Unsupported::NoEnergy)?;
    let count = estimates.len() as f64;
    let value = estimates.iter().map(|estimate| estimate.value).sum::<f64>() / count;
    let bare = |interval| Estimate {
        value,
        interval,
        error: None,
        without: Vec::new(),
        weight: Vec::new(),
        warning: None,
        decay: None,
        kernel: None,
    };
    if let Some(reason) = estimates.iter().find_map(|estimate| estimate.interval.as_ref().err()) {
        return Ok(bare(Err(reason.clone())));
    }
    if estimates.iter().any(|estimate| estimate.weight != first.weight) || first.weight.is_empty() {
        return Ok(bare(Err(NoInterval::NoBatches)));
    }
    let mean_without = |g: usize| estimates.iter().map(|estimate| estimate.without[g]).sum::<f64>() / count;
    let without: Vec<f64> = (0..first.weight.len()).map(mean_without).collect();
    // Batches are read in coarser bins than the values, so that their own mean is the centre of the jackknife.
    let centre = without.iter().zip(&first.weight).map(|(value, weight)| value * weight).sum();
    let spread = jackknife::spread(centre, &without, &first.weight);
    // What the figures' own intervals hold beside noise (bias of discs, the end of the run) does not average out.
    let beside = estimates.iter().map(|estimate| beyond_noise(estimate)).sum::<f64>() / count;
    let half_width = spread.half_width + beside;
    Ok(Estimate {
        error: Some(spread.error),
        without,
        weight: first.weight.clone(),
        warning: spread.warning,
        ..bare(Ok([value - half_width, value + half_width]))
    })
}

/// How much wider than its noise an interval is, to its wider side.
fn beyond_noise(estimate: &Estimate) -> f64 {
    let Ok([low, high]) = &estimate.interval else { return 0.0 };
    let half = (high - estimate.value).max(estimate.value - low);
    let centre = estimate.without.iter().zip(&estimate.weight).map(|(value, weight)| value * weight).sum();
    (half - jackknife::spread(centre, &estimate.without, &estimate.weight).half_width).max(0.0)
}

/// The mean over 500 and 1000 Hz of a parameter at one receiver.
///
/// # Errors
/// Where one of these octaves is missing or has no value.
pub fn single_number(receiver: &ReceiverFigures, parameter: Parameter) -> Figure {
    let find =
        |octave: &f64| receiver.bands.iter().find(|band| band.center_frequency_hz.total_cmp(octave).is_eq());
    let missing: Vec<String> = SINGLE_NUMBER_OCTAVES
        .iter()
        .filter(|octave| find(octave).is_none())
        .map(|octave| format!("{octave} Hz"))
        .collect();
    if !missing.is_empty() {
        return Err(Unsupported::OctavesMissing { missing: missing.join(", ") });
    }
    average(SINGLE_NUMBER_OCTAVES.iter().filter_map(find).map(|band| band.figure(parameter)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(value: f64, without: &[f64]) -> Figure {
        let weight = vec![1.0 / without.len() as f64; without.len()];
        let spread = jackknife::spread(value, without, &weight);
        Ok(Estimate {
            value,
            interval: Ok([value - spread.half_width, value + spread.half_width]),
            error: Some(spread.error),
            without: without.to_vec(),
            weight,
            warning: None,
            decay: None,
            kernel: None,
        })
    }

    fn half_width(figure: &Figure) -> f64 {
        let [low, high] = figure.as_ref().unwrap().interval.clone().unwrap();
        0.5 * (high - low)
    }

    #[test]
    fn errors_that_are_equal_stay_and_opposite_ones_cancel() {
        let noise = [0.3, -0.1, 0.2, -0.4];
        let (up, down) = (figure(2.0, &noise.map(|e| 2.0 + e)), figure(4.0, &noise.map(|e| 4.0 - e)));
        let same = average([&up, &figure(4.0, &noise.map(|e| 4.0 + e))]);
        assert!((same.as_ref().unwrap().value - 3.0).abs() < 1e-12);
        assert!((half_width(&same) / half_width(&up) - 1.0).abs() < 1e-9);
        assert!(half_width(&average([&up, &down])) < 1e-9);
    }

    #[test]
    fn independent_errors_average_by_the_root_of_their_number() {
        let (a, b) = (figure(1.0, &[1.1, 0.9, 1.1, 0.9]), figure(1.0, &[1.1, 1.1, 0.9, 0.9]));
        assert!((half_width(&average([&a, &b])) / half_width(&a) - 0.5_f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_missing_figure_is_no_average() {
        let missing: Figure = Err(Unsupported::NoReverberation);
        assert_eq!(average([&figure(1.0, &[1.0, 1.1]), &missing]), Err(Unsupported::NoReverberation));
        assert_eq!(average([]), Err(Unsupported::NoEnergy));
    }
}
