//! Averages of a parameter over bands (single numbers) and over receivers, with intervals.
//!
//! Values are averaged arithmetically. Figures of one response share their batches, so that their errors are correlated: the
//! average is read without each batch in turn and jackknifed like a parameter itself. The interval is that of the average of these places and
//! bands, not the spread of a room.
//!
//! References: [ISO3382-1] table A.1 for the octaves of single numbers (docs/references.md).

use crate::estimate::{Estimate, NoInterval, ParameterValue, Unsupported};
use crate::jackknife;
use crate::parameter::Parameter;
use crate::receiver::ReceiverParameters;

/// Octaves of most single numbers, nominal centres [Hz].
pub const SINGLE_NUMBER_OCTAVES: [f64; 2] = [500.0, 1000.0];
/// Octaves of the single numbers of lateral energy [Hz].
const LATERAL_OCTAVES: [f64; 4] = [125.0, 250.0, 500.0, 1000.0];
/// Octaves of the single numbers of support [Hz].
const SUPPORT_OCTAVES: [f64; 4] = [250.0, 500.0, 1000.0, 2000.0];

/// Arithmetic mean.
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Level of the mean energy of levels [dB].
fn energetic(levels_db: &[f64]) -> f64 {
    let energies: Vec<f64> = levels_db.iter().map(|level| libm::pow(10.0, 0.1 * level)).collect();
    10.0 * libm::log10(mean(&energies))
}

/// A number derived from parameters of one response, `of` their values: a mean, a slope. With its interval, as an average has it.
///
/// # Errors
/// Mean of a derived quantity, with its interval as by [`average`].
pub fn derived<'a>(
    of: impl Fn(&[f64]) -> f64,
    parameters: impl IntoIterator<Item = &'a ParameterValue>,
) -> ParameterValue {
    let estimates: Vec<&Estimate> = parameters
        .into_iter()
        .map(|estimate| estimate.as_ref().map_err(Clone::clone))
        .collect::<Result<_, _>>()?;
    let first = *estimates.first().ok_or(Unsupported::NoEnergy)?;
    let take = |read: &dyn Fn(&Estimate) -> f64| {
        of(&estimates.iter().map(|estimate| read(estimate)).collect::<Vec<f64>>())
    };
    let value = take(&|estimate| estimate.value);
    let bare = |interval| Estimate::bare(value, interval);
    if let Some(reason) = estimates.iter().find_map(|estimate| estimate.interval.as_ref().err()) {
        return Ok(bare(Err(reason.clone())));
    }
    if estimates.iter().any(|estimate| estimate.weight != first.weight) || first.weight.is_empty() {
        return Ok(bare(Err(NoInterval::NoBatches)));
    }
    let without: Vec<f64> =
        (0..first.weight.len()).map(|g| take(&|estimate: &Estimate| estimate.without[g])).collect();
    // Batches are read in coarser bins than the values, so that their own mean is the centre of the jackknife.
    let centre = without.iter().zip(&first.weight).map(|(value, weight)| value * weight).sum();
    let spread = jackknife::spread(centre, &without, &first.weight);
    // What the parameters' own intervals hold beside noise (bias of discs, the end of the run) does not average out.
    let values: Vec<f64> = estimates.iter().map(|estimate| estimate.value).collect();
    let mut interval = [value - spread.half_width, value + spread.half_width];
    for (at, estimate) in estimates.iter().enumerate() {
        for beyond in beyond_noise(estimate) {
            let mut values = values.clone();
            values[at] += beyond;
            let moved = of(&values) - value;
            interval[usize::from(moved > 0.0)] += moved;
        }
    }
    Ok(Estimate {
        error: Some(spread.error),
        without,
        weight: first.weight.clone(),
        warning: spread.warning,
        ..bare(Ok(interval))
    })
}

/// Arithmetic mean of parameters of one response.
///
/// # Errors
/// The first reason why one of them has no value, or [`Unsupported::NoEnergy`] where there is none at all.
pub fn average<'a>(parameters: impl IntoIterator<Item = &'a ParameterValue>) -> ParameterValue {
    derived(mean, parameters)
}

/// Reach of an interval beyond its noise: below, negative or zero, and above.
fn beyond_noise(estimate: &Estimate) -> [f64; 2] {
    let Ok([low, high]) = &estimate.interval else { return [0.0; 2] };
    let centre = estimate.without.iter().zip(&estimate.weight).map(|(value, weight)| value * weight).sum();
    let noise = jackknife::spread(centre, &estimate.without, &estimate.weight).half_width;
    [(low - estimate.value + noise).min(0.0), (high - estimate.value - noise).max(0.0)]
}

/// The single number of a parameter at one receiver: the mean over 500 and 1000 Hz, of lateral energy over 125 to 1000 Hz, of support over
/// 250 to 2000 Hz; that of L_J is of
/// energies.
///
/// # Errors
/// Where one of these octaves is missing or has no value.
pub fn single_number(receiver: &ReceiverParameters, parameter: Parameter) -> ParameterValue {
    let find =
        |octave: &f64| receiver.bands.iter().find(|band| band.center_frequency_hz.total_cmp(octave).is_eq());
    let (octaves, text): (&[f64], _) = match parameter {
        Parameter::SupportEarly | Parameter::SupportLate => (&SUPPORT_OCTAVES, "250 to 2000"),
        _ if Parameter::LATERAL.contains(&parameter) => (&LATERAL_OCTAVES, "125 to 1000"),
        _ => (&SINGLE_NUMBER_OCTAVES, "500 and 1000"),
    };
    let missing: Vec<String> =
        octaves.iter().filter(|octave| find(octave).is_none()).map(|octave| format!("{octave} Hz")).collect();
    if !missing.is_empty() {
        return Err(Unsupported::OctavesMissing { octaves: text, missing: missing.join(", ") });
    }
    let mean = if parameter == Parameter::LateLateralLevel { energetic } else { mean };
    derived(mean, octaves.iter().filter_map(find).map(|band| band.parameter(parameter)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value: f64, without: &[f64]) -> ParameterValue {
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

    fn half_width(estimate: &ParameterValue) -> f64 {
        let [low, high] = estimate.as_ref().unwrap().interval.clone().unwrap();
        0.5 * (high - low)
    }

    #[test]
    fn errors_that_are_equal_stay_and_opposite_ones_cancel() {
        let noise = [0.3, -0.1, 0.2, -0.4];
        let (up, down) = (estimate(2.0, &noise.map(|e| 2.0 + e)), estimate(4.0, &noise.map(|e| 4.0 - e)));
        let same = average([&up, &estimate(4.0, &noise.map(|e| 4.0 + e))]);
        assert!((same.as_ref().unwrap().value - 3.0).abs() < 1e-12);
        assert!((half_width(&same) / half_width(&up) - 1.0).abs() < 1e-9);
        assert!(half_width(&average([&up, &down])) < 1e-9);
    }

    #[test]
    fn independent_errors_average_by_the_root_of_their_number() {
        let (a, b) = (estimate(1.0, &[1.1, 0.9, 1.1, 0.9]), estimate(1.0, &[1.1, 1.1, 0.9, 0.9]));
        assert!((half_width(&average([&a, &b])) / half_width(&a) - 0.5_f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_missing_figure_is_no_average() {
        let missing: ParameterValue = Err(Unsupported::NoReverberation);
        assert_eq!(average([&estimate(1.0, &[1.0, 1.1]), &missing]), Err(Unsupported::NoReverberation));
        assert_eq!(average([]), Err(Unsupported::NoEnergy));
    }
}
