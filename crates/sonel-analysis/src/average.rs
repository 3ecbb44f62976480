//! Averages of a parameter over bands (single numbers) and over receivers, with intervals.
//!
//! Values are averaged arithmetically. Figures of one response share their batches, so that their errors are correlated: the
//! average is read without each batch in turn and jackknifed like a parameter itself. The interval is that of the average of these places and
//! bands, not the spread of a room.
//!
//! References: [ISO3382-1] table A.1 for the octaves of single numbers (docs/references.md).

use crate::derived::derived;
use crate::estimate::{ParameterValue, Unsupported};
use crate::octave;
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

/// Arithmetic mean of parameters of one response.
///
/// # Errors
/// The first reason why one of them has no value, or [`Unsupported::NoEnergy`] where there is none at all.
pub fn average<'a>(parameters: impl IntoIterator<Item = &'a ParameterValue>) -> ParameterValue {
    derived(mean, parameters)
}

/// The single number of a parameter at one receiver: the mean over 500 and 1000 Hz, of lateral energy over 125 to 1000 Hz, of support over
/// 250 to 2000 Hz; that of L_J is of
/// energies.
///
/// # Errors
/// Where one of these octaves is missing or has no value.
pub fn single_number(receiver: &ReceiverParameters, parameter: Parameter) -> ParameterValue {
    let (octaves, text): (&[f64], _) = match parameter {
        Parameter::SupportEarly | Parameter::SupportLate => (&SUPPORT_OCTAVES, "250 to 2000"),
        _ if Parameter::LATERAL.contains(&parameter) => (&LATERAL_OCTAVES, "125 to 1000"),
        _ => (&SINGLE_NUMBER_OCTAVES, "500 and 1000"),
    };
    if let Some(missing) = octave::missing(octaves, |octave| receiver.band(octave).is_some()) {
        return Err(Unsupported::OctavesMissing { octaves: text, missing });
    }
    let mean = if parameter == Parameter::LateLateralLevel { energetic } else { mean };
    let bands = octaves.iter().filter_map(|octave| receiver.band(*octave));
    derived(mean, bands.map(|band| band.parameter(parameter)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::Estimate;
    use crate::jackknife;

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
            is_time: false,
            materials: Vec::new(),
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
