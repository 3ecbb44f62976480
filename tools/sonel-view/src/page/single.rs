//! Single numbers of the page: those of parameters, and the speech transmission index.

use sonel::acoustics::just_noticeable as noticeable;
use sonel::analysis::average::single_number;
use sonel::analysis::estimate::{Estimate, NoInterval};
use sonel::analysis::seats::{Spread, spread};
use sonel::analysis::{Parameter, ParameterValue, ReceiverParameters, report};

use super::Subject;

/// Parameters of every page, in the order of the tables.
const USUAL: [Parameter; 7] = [
    Parameter::Strength,
    Parameter::T30,
    Parameter::EarlyDecayTime,
    Parameter::ClarityC50,
    Parameter::ClarityC80,
    Parameter::DefinitionD50,
    Parameter::CenterTime,
];

/// A single number of a source at a receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Single {
    /// Mean over octaves.
    Of(Parameter),
    /// Speech transmission index.
    Speech,
}

impl Single {
    /// Those of these responses: lateral ones where any has directions, ratios of speech where any has noise.
    pub fn of(subjects: &[Subject]) -> Vec<Self> {
        let is_lateral = subjects.iter().any(|subject| subject.echograms().directions.is_some());
        let has_noise = subjects.iter().flat_map(|it| &it.parameters).any(|it| it.in_noise.is_some());
        let lateral = Parameter::LATERAL.into_iter().filter(|_| is_lateral);
        let in_noise = Parameter::IN_NOISE.into_iter().filter(|_| has_noise);
        USUAL.into_iter().chain(lateral).chain(in_noise).map(Self::Of).chain([Self::Speech]).collect()
    }

    /// Symbol, unit and the factor to it.
    pub fn heading(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::Of(parameter) => parameter.heading(),
            Self::Speech => ("STI", "", 1.0),
        }
    }

    /// Symbol and unit.
    pub fn label(self) -> String {
        let (symbol, unit, _) = self.heading();
        if unit.is_empty() { symbol.to_owned() } else { format!("{symbol} [{unit}]") }
    }

    /// Its value.
    ///
    /// # Errors
    /// Why there is none.
    pub fn value(self, receiver: &ReceiverParameters) -> ParameterValue {
        match self {
            Self::Of(parameter) => single_number(receiver, parameter),
            Self::Speech => receiver.speech_transmission_index.clone(),
        }
    }

    /// The just-noticeable difference about `value`, in its own unit.
    pub fn just_noticeable(self, value: f64) -> f64 {
        match self {
            Self::Of(parameter) => parameter.just_noticeable(value),
            Self::Speech => noticeable::SPEECH_TRANSMISSION_INDEX,
        }
    }

    /// The same in the unit of its heading, or as a share.
    pub fn just_noticeable_in_words(self) -> String {
        let difference = self.just_noticeable(1.0);
        match self {
            Self::Of(parameter) if parameter.is_noticed_relatively() => format!("{} %", 100.0 * difference),
            _ => (difference * self.heading().2).to_string(),
        }
    }

    /// The mean over `receivers`.
    pub fn mean(self, receivers: &[ReceiverParameters]) -> String {
        let values: Vec<ParameterValue> = receivers.iter().map(|receiver| self.value(receiver)).collect();
        mean(&values, self.heading().2)
    }
}

/// The mean over those of `values` that there are, and how many these are where some are missing.
fn mean(values: &[ParameterValue], factor: f64) -> String {
    let Spread { mean, count, of, .. } = spread(&values.iter().collect::<Vec<_>>());
    let mean = cell(&mean, factor);
    if (1..of).contains(&count) { format!("{mean} ({count} of {of})") } else { mean }
}

/// Half-width of the interval, on its wider side: where the run ends early, it reaches further to one.
pub(crate) fn half_width(estimate: &Estimate) -> Result<f64, &NoInterval> {
    estimate.interval.as_ref().map(|[low, high]| (high - estimate.value).max(estimate.value - low))
}

/// Value with the half-width of its interval and, where it is known, that of the materials, as tables have it.
pub(crate) fn cell(estimate: &ParameterValue, factor: f64) -> String {
    let Ok(estimate) = estimate else { return "–".to_owned() };
    let value = estimate.value * factor;
    let half = half_width(estimate).ok().map(|half| factor * half);
    let digits = report::digits(value, half.unwrap_or(0.0));
    let least = 0.1_f64.powi(digits as i32);
    let beside = |half: f64| {
        if half < 0.5 * least { format!(" ± <{least:.digits$}") } else { format!(" ± {half:.digits$}") }
    };
    let materials = report::by_materials(estimate, factor, digits);
    // The first is that of the simulation.
    let unknown = if materials.is_empty() { "" } else { " ± –" };
    let simulation = half.map_or_else(|| unknown.to_owned(), beside);
    format!("{value:.digits$}{simulation}{materials}")
}

#[cfg(test)]
mod tests {
    use sonel::analysis::Unsupported;

    use super::*;

    #[test]
    fn a_seat_without_a_value_does_not_take_the_mean() {
        let seat = |value: f64| Ok(Estimate::bare(value, Ok([value - 0.1, value + 0.1])));
        let seats = [seat(1.0), Err(Unsupported::NoReverberation), seat(2.0)];
        assert!(mean(&seats, 1.0).starts_with("1.5") && mean(&seats, 1.0).ends_with("(2 of 3)"));
        assert_eq!(mean(&seats[1..2], 1.0), "–");
    }

    #[test]
    fn a_half_width_is_never_nothing() {
        for (value, half, factor, text) in [
            (0.4512, 0.0031, 1.0, "0.451 ± 0.003"),
            (0.4512, 0.0001, 1.0, "0.451 ± <0.001"),
            (0.8512, 0.0913, 1.0, "0.851 ± 0.091"),
            (0.45123, 0.0121, 100.0, "45.1 ± 1.2"),
        ] {
            let estimate = Ok(Estimate::bare(value, Ok([value - half, value + half])));
            assert_eq!(cell(&estimate, factor), text);
        }
    }
}
