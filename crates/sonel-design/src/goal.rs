//! Wanted value of a parameter: `t30=1.8s±5%@500,1000`.

use std::str::FromStr;

use sonel_analysis::Parameter;
use thiserror::Error;

use sonel::study::target::{Limit, TargetError, in_unit, number_and_unit, parameter};

/// A value that the mean over receivers shall have.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    /// Parameter that the goal is for.
    pub parameter: Parameter,
    /// Value in its unit.
    pub value: f64,
    /// Tolerance, in the same unit.
    pub tolerance: f64,
    /// Nominal centres of the bands [Hz]; all where there are none.
    pub centers_hz: Vec<f64>,
}

/// Error of a goal's text.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum GoalError {
    /// Not a goal at all.
    #[error(
        "\"{0}\" is not a goal: write PARAMETER=VALUE±TOLERANCE@BANDS, each number with its unit (s, ms, dB; d50: %), such as \"t30=1.8s±5%@500,1000\" or \"d50=70%±5%\" (+- for ±; all bands without @)"
    )]
    Form(String),
    /// No such parameter.
    #[error(transparent)]
    Parameter(#[from] TargetError),
}

impl FromStr for Goal {
    type Err = GoalError;

    fn from_str(text: &str) -> Result<Self, GoalError> {
        let form = || GoalError::Form(text.to_owned());
        let (name, rest) = text.split_once('=').ok_or_else(form)?;
        let parameter = parameter(name)?;
        let (values, bands) =
            rest.split_once('@').map_or((rest, None), |(values, bands)| (values, Some(bands)));
        let values = values.replace("+-", "±");
        let (value, tolerance) = values.split_once('±').ok_or_else(form)?;
        let read = |text: &str| {
            let (number, unit) = number_and_unit(text);
            in_unit(parameter, number?, unit)
        };
        let Some(Limit::Absolute(value)) = read(value) else { return Err(form()) };
        let tolerance = match read(tolerance).ok_or_else(form)? {
            Limit::JustNoticeable(times) => times * parameter.just_noticeable(value),
            Limit::Relative(part) => part * value,
            Limit::Absolute(tolerance) => tolerance,
        };
        let center = |band: &str| band.trim().trim_end_matches("Hz").trim().parse().map_err(|_| form());
        let centers_hz: Vec<f64> =
            bands.map_or(Ok(Vec::new()), |bands| bands.split(',').map(center).collect())?;
        let is_time = parameter.is_noticed_relatively();
        if tolerance <= 0.0 || (is_time && value <= 0.0) {
            return Err(form());
        }
        Ok(Self { parameter, value, tolerance, centers_hz })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_are_read_in_the_units_of_their_parameter() {
        let goal: Goal = "T30 = 1.8 s ±5% @ 500,1000 Hz".parse().unwrap();
        assert_eq!((goal.parameter, goal.centers_hz), (Parameter::T30, vec![500.0, 1000.0]));
        assert!((goal.value - 1.8).abs() + (goal.tolerance - 0.09).abs() < 1e-12);
        let goal: Goal = "c80=-1dB+-1jnd".parse().unwrap();
        assert!(
            (goal.value + 1.0).abs() + (goal.tolerance - 1.0).abs() < 1e-12 && goal.centers_hz.is_empty()
        );
        let goal: Goal = "d50=70%±5%".parse().unwrap();
        assert!((goal.value - 0.7).abs() + (goal.tolerance - 0.05).abs() < 1e-12);
    }

    #[test]
    fn other_words_are_refused() {
        for text in [
            "t30",
            "t30=1.8s",
            "t30=1.8dB±5%",
            "t30=1.8s±0%",
            "t30=-1s±5%",
            "t30=1s±5%@x",
            "c80=1%±1dB",
            "d50=0.7±5%",
            "t30=1%±5%",
        ] {
            assert!(matches!(text.parse::<Goal>(), Err(GoalError::Form(_))), "{text}");
        }
        assert!(matches!("rt=1s±5%".parse::<Goal>(), Err(GoalError::Parameter(_))));
    }
}
