//! Bias and standard deviation of the parameters over repeats.
//!
//! The error of a level or a clarity is a difference [dB], that of a time is relative [%]. Errors of all receivers and bands
//! are taken together: deviations as root mean squares, biases as means. A parameter that a run with that setting and number of
//! packets or the reference refused is left out there and counted; where more than a tenth is missing, there is no point at all.

use sonel_analysis::Parameter;

use super::fit::{self, Measured};
use super::runs::{SweepRun, Tradeoff};
use super::sweep::JUDGED;

/// The unit of errors of `parameter`.
#[must_use]
pub fn unit(parameter: Parameter) -> &'static str {
    if parameter.is_noticed_relatively() { "%" } else { "dB" }
}

/// A twentieth of the just-noticeable difference of `parameter`, in [`unit()`].
#[must_use]
pub fn target(parameter: Parameter) -> f64 {
    let reference = if parameter.is_noticed_relatively() { 100.0 } else { 1.0 };
    parameter.just_noticeable(reference) / 20.0
}

/// Error of `value` against `reference`, in [`unit()`].
#[must_use]
pub fn error(parameter: Parameter, value: f64, reference: f64) -> f64 {
    if parameter.is_noticed_relatively() { 100.0 * (value / reference - 1.0) } else { value - reference }
}

/// Errors of one setting in one parameter, from few packets to many.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Index of the setting.
    pub setting: usize,
    /// One of [`JUDGED`].
    pub parameter: Parameter,
    /// By number of packets, ascending; those with too many parameters refused are missing.
    pub points: Vec<Point>,
}

/// Largest share of refused parameters [1] where the others stand for all. Chosen, not measured.
const MOST_REFUSED: f64 = 0.1;

/// Errors at one number of packets.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Emissions per source.
    pub packets: u64,
    /// CPU seconds of every repeat [s].
    pub seconds: Vec<f64>,
    /// Error of every repeat and parameter, in [`unit()`]: [repeat][parameter].
    pub errors: Vec<Vec<f64>>,
    /// 95 % half-width of the reference, root mean square over parameters, in [`unit()`].
    pub reference_half_width: f64,
    /// Figures left out.
    pub refused: usize,
}

impl Point {
    /// Mean CPU seconds [s], where one repeat may be left out.
    #[must_use]
    pub fn mean_seconds(&self, left_out: Option<usize>) -> f64 {
        let kept: Vec<f64> = kept(&self.seconds, left_out).copied().collect();
        kept.iter().sum::<f64>() / kept.len() as f64
    }

    /// Standard deviation over repeats, root mean square over parameters, in [`unit()`]; one repeat may be left out.
    #[must_use]
    pub fn deviation(&self, left_out: Option<usize>) -> f64 {
        let runs: Vec<&Vec<f64>> = kept(&self.errors, left_out).collect();
        let (repeats, parameters) = (runs.len() as f64, self.errors[0].len());
        let variance = |estimate: usize| {
            let mean = runs.iter().map(|run| run[estimate]).sum::<f64>() / repeats;
            runs.iter().map(|run| (run[estimate] - mean) * (run[estimate] - mean)).sum::<f64>()
                / (repeats - 1.0)
        };
        ((0..parameters).map(variance).sum::<f64>() / parameters as f64).sqrt()
    }

    /// Standard deviation with its interval; none where nothing scatters.
    #[must_use]
    pub fn measured_deviation(&self) -> Option<Measured> {
        let deviation = |left_out| Some(self.deviation(left_out)).filter(|deviation| *deviation > NOTHING);
        fit::ratio_over_repeats(self.errors.len(), deviation)
    }

    /// Mean error over repeats and parameters, in [`unit()`]. Its interval includes that of the reference, as if all of its parameters
    /// were off together.
    #[must_use]
    pub fn bias(&self) -> Option<Measured> {
        let mean = |left_out| {
            let runs: Vec<&Vec<f64>> = kept(&self.errors, left_out).collect();
            let sum: f64 = runs.iter().map(|run| run.iter().sum::<f64>()).sum();
            Some(sum / (runs.len() * self.errors[0].len()) as f64)
        };
        let own = fit::over_repeats(self.errors.len(), mean)?;
        let with_reference =
            |half: f64| (half * half + self.reference_half_width * self.reference_half_width).sqrt();
        Some(Measured::within(own.value, own.half_width().map(with_reference)))
    }

    /// CPU seconds with their interval.
    #[must_use]
    pub fn measured_seconds(&self) -> Option<Measured> {
        fit::ratio_over_repeats(self.seconds.len(), |left_out| Some(self.mean_seconds(left_out)))
    }

    /// 1 / (variance × CPU seconds) [1/(unit² s)]; none where nothing scatters.
    #[must_use]
    pub fn efficiency(&self) -> Option<Measured> {
        fit::ratio_over_repeats(self.seconds.len(), |left_out| {
            let deviation = self.deviation(left_out);
            let cost = deviation * deviation * self.mean_seconds(left_out);
            (deviation > NOTHING && cost > 0.0).then(|| 1.0 / cost)
        })
    }
}

/// A deviation below this is nothing, in [`unit()`]: a few hundredths of a percent of the targets, and what rounding leaves of
/// parameters that nothing is sampled for.
pub const NOTHING: f64 = 1e-4;

fn kept<T>(of: &[T], left_out: Option<usize>) -> impl Iterator<Item = &T> {
    of.iter().enumerate().filter(move |(index, _)| Some(*index) != left_out).map(|(_, value)| value)
}

impl Curve {
    /// Exponent of the deviation over CPU seconds: −0.5 for an estimator without overhead.
    #[must_use]
    pub fn slope(&self) -> Option<Measured> {
        let repeats = self.points.first()?.seconds.len();
        fit::over_repeats(repeats, |left_out| {
            let logarithms: Vec<(f64, f64, f64)> = self
                .points
                .iter()
                .map(|point| (point.mean_seconds(left_out), point.deviation(left_out)))
                .filter(|(seconds, deviation)| *seconds > 0.0 && *deviation > NOTHING)
                .map(|(seconds, deviation)| (libm::log(seconds), libm::log(deviation), 1.0))
                .collect();
            Some(fit::line(&logarithms)?.slope.value)
        })
    }

    /// Efficiency with the most packets, [`Point::efficiency`].
    #[must_use]
    pub fn efficiency(&self) -> Option<Measured> {
        self.points.last()?.efficiency()
    }
}

/// The curves of `tradeoff`: setting by setting, in the order of [`JUDGED`].
#[must_use]
pub fn curves(tradeoff: &Tradeoff) -> Vec<Curve> {
    let curve = |setting, parameter| Curve {
        setting,
        parameter,
        points: tradeoff
            .sweep
            .packets
            .iter()
            .filter_map(|&packets| point(tradeoff, &tradeoff.runs_of(setting, packets), parameter))
            .collect(),
    };
    let settings = 0..tradeoff.sweep.settings.len();
    settings.flat_map(|setting| JUDGED.map(|parameter| curve(setting, parameter))).collect()
}

/// The errors in `parameter` of `runs`, which differ in their seeds alone.
fn point(tradeoff: &Tradeoff, runs: &[&SweepRun], parameter: Parameter) -> Option<Point> {
    let all = (0..tradeoff.cells.len()).filter(|&cell| tradeoff.cells[cell].parameter == parameter);
    let all: Vec<usize> = all.collect();
    let reference = &tradeoff.reference.values;
    let parameters: Vec<(usize, f64, f64)> = all
        .iter()
        .filter(|&&cell| runs.iter().all(|run| run.values[cell].is_some()))
        .filter_map(|&cell| reference[cell].map(|(value, half)| (cell, value, half.unwrap_or(0.0))))
        .collect();
    let refused = all.len() - parameters.len();
    if parameters.is_empty() || refused as f64 > MOST_REFUSED * all.len() as f64 {
        return None;
    }
    let squares = parameters.iter().map(|&(_, value, half)| error(parameter, value + half, value));
    let mean_square = squares.map(|error| error * error).sum::<f64>() / parameters.len() as f64;
    let errors = |run: &&SweepRun| -> Vec<f64> {
        let found = |&(cell, reference, _): &(usize, f64, f64)| {
            Some(error(parameter, run.values[cell]?.0, reference))
        };
        parameters.iter().filter_map(found).collect()
    };
    Some(Point {
        packets: runs.first()?.packets,
        seconds: runs.iter().map(|run| run.seconds.total()).collect(),
        errors: runs.iter().map(errors).collect(),
        reference_half_width: mean_square.sqrt(),
        refused,
    })
}

/// A parameter of one setting with one number of packets.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterErrors {
    /// Mean over repeats with its 95 % interval, in the parameter's unit.
    pub mean: Measured,
    /// Standard deviation over repeats, in the parameter's unit.
    pub deviation: f64,
    /// Mean of the half-widths that the runs themselves state, in the parameter's unit.
    pub stated_half_width: Option<f64>,
}

/// What the `runs` of one setting and number of packets say of `cell`; none where any of them refused it.
#[must_use]
pub fn estimate(runs: &[&SweepRun], cell: usize) -> Option<ParameterErrors> {
    let values: Vec<(f64, Option<f64>)> = runs.iter().map(|run| run.values[cell]).collect::<Option<_>>()?;
    let repeats = values.len() as f64;
    let mean = values.iter().map(|(value, _)| value).sum::<f64>() / repeats;
    let square = values.iter().map(|(value, _)| (value - mean) * (value - mean)).sum::<f64>();
    let deviation = if values.len() > 1 { (square / (repeats - 1.0)).sqrt() } else { 0.0 };
    let half_width = (values.len() > 1).then(|| {
        sonel_analysis::student::quantile(0.05, values.len() as u32 - 1) * deviation / repeats.sqrt()
    });
    let stated: Option<Vec<f64>> = values.iter().map(|(_, half_width)| *half_width).collect();
    Some(ParameterErrors {
        mean: Measured::within(mean, half_width),
        deviation,
        stated_half_width: stated.map(|stated| stated.iter().sum::<f64>() / repeats),
    })
}

/// Why some of what is said of a parameter is missing: of what its runs `found`, of the value of its reference.
#[must_use]
pub fn missing(
    found: Option<&ParameterErrors>,
    reference: Option<(f64, Option<f64>)>,
) -> Option<&'static str> {
    match (found, reference) {
        (None, None) => Some("refused in one of the runs and in the reference"),
        (None, Some(_)) => Some("refused in one of the runs"),
        (Some(_), None) => Some("refused in the reference"),
        (Some(estimate), Some(_)) => {
            estimate.stated_half_width.is_none().then_some("a run states no interval")
        }
    }
}

#[cfg(test)]
mod tests;
