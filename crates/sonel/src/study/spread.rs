//! Half-widths of the parameters of a rendering, in just-noticeable differences.
//!
//! In that unit parameters of all kinds compare, and a reverberation time that is refused as too noisy still says how
//! noisy it is.

use sonel_analysis::estimate::{KernelShift, NoInterval};
use sonel_analysis::{Parameter, ParameterValue, ReceiverParameters, Unsupported, student};
use thiserror::Error;

use crate::study::kurtosis::excess_kurtosis;

/// Figures that a plan predicts (docs/interface.md).
pub const PLANNED: [Parameter; 4] =
    [Parameter::Level, Parameter::T30, Parameter::EarlyDecayTime, Parameter::ClarityC80];

/// The just-noticeable difference about `value` that half-widths are counted in. Of clarity it is at least the change that 0.05 of the energy
/// makes, the difference of definition that is noticed [ISO3382-1]: nobody needs 1 dB of late sound 120 dB below the early one.
#[must_use]
pub fn unit(parameter: Parameter, value: f64) -> f64 {
    let own = parameter.just_noticeable(value);
    if !parameter.is_clarity() {
        return own;
    }
    let ratio = libm::pow(10.0, -0.1 * value.abs());
    let by_share = 10.0 / std::f64::consts::LN_10 * (1.0 + ratio) * (1.0 + ratio) / ratio;
    own.max(Parameter::DefinitionD50.just_noticeable(0.0) * by_share)
}

/// Student's t of a 95 % interval over `batches` batches, at least two.
#[must_use]
pub fn student_factor(batches: u32) -> f64 {
    student::quantile(student::MISSED, batches.max(2) - 1)
}

/// Address of a parameter: row of [`sonel_analysis::parameters`], band, parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParameterPlace {
    /// Source and receiver, in the order of [`sonel_analysis::parameters`].
    pub row: usize,
    /// Index of the band.
    pub band: usize,
    /// The parameter.
    pub parameter: Parameter,
}

/// Uncertainty of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// The parameter.
    pub place: ParameterPlace,
    /// Value, in the unit of the parameter; none where it is refused as too noisy.
    pub value: Option<f64>,
    /// Half of its 95 % interval, or why nobody can say.
    pub half_width: Result<HalfWidth, NoWidth>,
    /// Bias of discs and spheres [JND]; none where nothing is averaged over an area.
    pub kernel: Option<KernelShift>,
    /// Excess kurtosis of the batches: above zero where few of them are far from the others.
    pub excess_kurtosis: f64,
}

/// Why nobody can say how wide an interval is.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum NoWidth {
    /// The parameter has no value.
    #[error(transparent)]
    Value(#[from] Unsupported),
    /// The value has no interval.
    #[error(transparent)]
    Interval(#[from] NoInterval),
}

/// Half of a 95 % interval, in just-noticeable differences.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HalfWidth {
    /// From the spread of the batches.
    pub noise: f64,
    /// From the bias of discs and spheres, the skewness of the batches and the end of the run.
    pub beside: f64,
}

impl HalfWidth {
    /// Both.
    #[must_use]
    pub fn total(self) -> f64 {
        self.noise + self.beside
    }
}

/// Mean excess kurtosis of the batches of `parameter`, as far as it is above zero: over all bands and receivers together, as that of a single
/// parameter scatters too much.
pub(crate) fn pooled_kurtosis(readings: &[Reading], parameter: Parameter) -> f64 {
    let of_parameter = readings.iter().filter(|r| r.place.parameter == parameter && r.value.is_some());
    let (sum, count) =
        of_parameter.fold((0.0, 0.0), |(sum, count), r| (sum + r.excess_kurtosis.max(0.0), count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// The readings of `parameters` in all `parameters`.
#[must_use]
pub fn readings(parameters: &[ReceiverParameters], wanted: &[Parameter]) -> Vec<Reading> {
    let mut readings = Vec::new();
    for (row, receiver) in parameters.iter().enumerate() {
        for (band, parameters) in receiver.bands.iter().enumerate() {
            for &parameter in wanted {
                let estimate = parameters.parameter(parameter);
                let (value, half_width) = reading(estimate, parameter);
                let kernel = estimate.as_ref().ok().and_then(|estimate| {
                    let unit = unit(parameter, estimate.value);
                    estimate.kernel.map(|k| KernelShift { shift: k.shift / unit, sigma: k.sigma / unit })
                });
                let place = ParameterPlace { row, band, parameter };
                let excess_kurtosis =
                    estimate.as_ref().map_or(0.0, |estimate| excess_kurtosis(&estimate.without));
                readings.push(Reading { place, value, half_width, kernel, excess_kurtosis });
            }
        }
    }
    readings
}

fn reading(estimate: &ParameterValue, parameter: Parameter) -> (Option<f64>, Result<HalfWidth, NoWidth>) {
    let estimate = match estimate {
        Ok(estimate) => estimate,
        Err(Unsupported::Noisy { just_noticeable }) => {
            return (None, Ok(HalfWidth { noise: *just_noticeable, beside: 0.0 }));
        }
        Err(reason) => return (None, Err(reason.clone().into())),
    };
    let half_width = match (&estimate.interval, &estimate.error) {
        (Ok([low, high]), Some(error)) => {
            let unit = unit(parameter, estimate.value);
            let noise = student::quantile(student::MISSED, error.freedom) * error.sigma;
            Ok(HalfWidth { noise: noise / unit, beside: ((0.5 * (high - low) - noise) / unit).max(0.0) })
        }
        (Err(reason), _) => Err(reason.clone().into()),
        (_, None) => Err(NoInterval::NoBatches.into()),
    };
    (Some(estimate.value), half_width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clarity_counts_as_its_share_of_the_energy() {
        let c80 = |value| unit(Parameter::ClarityC80, value);
        assert!((c80(0.0) - 1.0).abs() < 1e-12 && (c80(3.0) - 1.0).abs() < 0.01);
        // D = 0.99: a change by 0.05 of its distance from certainty.
        assert!((c80(19.956_351_945_975_5) - 0.05 * 10.0 / libm::log(10.0) / (0.99 * 0.01)).abs() < 1e-6);
        assert!((c80(-10.0) - c80(10.0)).abs() < 1e-12 && c80(121.0) > 1e9);
        assert!((unit(Parameter::T30, 2.0) - 0.1).abs() < 1e-12);
    }
}
