//! Targets of half-widths: `t30<1%,level<0.1dB,c80<0.2dB`.
//!
//! A limit applies to the half-width of the 95 % interval of a parameter in every band at every evaluation receiver.
//! Reverberation times are limited in per cent of
//! themselves or in seconds, levels and clarity in dB, everything in just-noticeable differences (`jnd`).

use std::fmt;
use std::str::FromStr;

use sonel_analysis::Parameter;
use thiserror::Error;

use crate::study::spread::{PLANNED, ParameterPlace, unit};

/// Several limits, all to be kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Targets {
    limits: Vec<(Parameter, Limit)>,
}

/// A limit to half of an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// In just-noticeable differences.
    JustNoticeable(f64),
    /// A part of the value.
    Relative(f64),
    /// A number in the unit of the parameter.
    Absolute(f64),
}

/// Error of a target's text.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum TargetError {
    /// Not a limit at all.
    #[error("\"{0}\" is not a target: write PARAMETER<LIMIT such as t30<1%, level<0.1dB or c80<0.2jnd")]
    Form(String),
    /// No such parameter.
    #[error(
        "unknown parameter \"{0}\": choose among {names} (example: t30<1%)",
        names = names()
    )]
    ParameterValue(String),
    /// A unit that this parameter does not have.
    #[error(
        "the limit of {estimate} has {}: write {estimate}<{example} or {estimate}<0.2jnd",
        if unit.is_empty() { "no unit".to_owned() } else { format!("the unit \"{unit}\"") }
    )]
    Unit {
        /// The parameter.
        estimate: &'static str,
        /// The text found.
        unit: String,
        /// The texts allowed.
        example: &'static str,
    },
    /// Not a number above zero.
    #[error("the limit \"{0}\" is not a number above 0 (example: t30<1%)")]
    Number(String),
    /// The same parameter again.
    #[error("{0} has two limits: give one per parameter")]
    Twice(&'static str),
}

impl From<TargetError> for crate::Error {
    fn from(error: TargetError) -> Self {
        Self::Options(vec![error.to_string()])
    }
}

/// All names, as help and messages list them.
#[must_use]
pub fn names() -> String {
    Parameter::ALL.map(Parameter::short_name).join(", ")
}

/// The parameter that is written `name`.
///
/// # Errors
/// [`TargetError::ParameterValue`].
pub fn parameter(name: &str) -> Result<Parameter, TargetError> {
    let name = name.trim().to_lowercase();
    let found = Parameter::ALL.into_iter().find(|parameter| parameter.short_name() == name);
    found.ok_or(TargetError::ParameterValue(name))
}

impl Targets {
    /// Every planned parameter within `limit` just-noticeable differences.
    #[must_use]
    pub fn just_noticeable(limit: f64) -> Self {
        Self { limits: PLANNED.map(|parameter| (parameter, Limit::JustNoticeable(limit))).to_vec() }
    }

    /// The parameters that are limited.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        self.limits.iter().map(|(parameter, _)| *parameter).collect()
    }

    /// The limit of `parameter` as it is written: a number and its unit; none where it is not limited.
    #[must_use]
    pub fn written(&self, parameter: Parameter) -> Option<(f64, &'static str)> {
        let (_, limit) = self.limits.iter().find(|(known, _)| *known == parameter)?;
        let (_, own, factor) = parameter.heading();
        Some(match limit {
            Limit::JustNoticeable(limit) => (*limit, "JND"),
            Limit::Relative(limit) => (100.0 * limit, "%"),
            Limit::Absolute(limit) => (limit * factor, own),
        })
    }

    /// Largest half-width of the parameter at `place` in just-noticeable differences, where its value is `value`; none where it is not
    /// limited, or limited in its own unit and without a value.
    #[must_use]
    pub fn limit(&self, place: ParameterPlace, value: Option<f64>) -> Option<f64> {
        let (parameter, limit) = self.limits.iter().find(|(parameter, _)| *parameter == place.parameter)?;
        match limit {
            Limit::JustNoticeable(limit) => Some(*limit),
            // The unit of a relative parameter is a part of its value, whatever that is.
            Limit::Relative(limit) if parameter.is_noticed_relatively() => {
                Some(limit / parameter.just_noticeable(1.0))
            }
            Limit::Relative(limit) => value.map(|value| limit * value.abs() / unit(*parameter, value)),
            Limit::Absolute(limit) => value.map(|value| limit / unit(*parameter, value)),
        }
    }
}

impl FromStr for Targets {
    type Err = TargetError;

    fn from_str(text: &str) -> Result<Self, TargetError> {
        let mut limits: Vec<(Parameter, Limit)> = Vec::new();
        for word in text.split(',').map(str::trim) {
            let (name, limit) = word.split_once('<').ok_or_else(|| TargetError::Form(word.to_owned()))?;
            let parameter = parameter(name)?;
            let estimate = parameter.short_name();
            if limits.iter().any(|(known, _)| *known == parameter) {
                return Err(TargetError::Twice(estimate));
            }
            let (number, unit) = number_and_unit(limit.trim().trim_start_matches('='));
            let number = number.filter(|number| *number > 0.0);
            let number = number.ok_or_else(|| TargetError::Number(word.to_owned()))?;
            let limit = in_unit(parameter, number, unit);
            let example = parameter.example_of_limit();
            let unknown = || TargetError::Unit { estimate, unit: unit.to_owned(), example };
            limits.push((parameter, limit.ok_or_else(unknown)?));
        }
        Ok(Self { limits })
    }
}

/// A finite number, if there is one, and the unit behind it.
#[must_use]
pub fn number_and_unit(text: &str) -> (Option<f64>, &str) {
    let text = text.trim();
    let digits = text.trim_end_matches(|c: char| c.is_alphabetic() || c == '%');
    (digits.trim().parse().ok().filter(|number: &f64| number.is_finite()), &text[digits.len()..])
}

/// A limit in `unit`, if the parameter has that unit.
#[must_use]
pub fn in_unit(parameter: Parameter, number: f64, unit: &str) -> Option<Limit> {
    let (_, own, factor) = parameter.heading();
    match &*unit.to_lowercase() {
        "jnd" => Some(Limit::JustNoticeable(number)),
        // D50 is itself a percentage.
        "%" if own == "%" => Some(Limit::Absolute(number / factor)),
        "%" if matches!(own, "s" | "ms") => Some(Limit::Relative(number / 100.0)),
        "s" if matches!(own, "s" | "ms") => Some(Limit::Absolute(number)),
        "ms" if matches!(own, "s" | "ms") => Some(Limit::Absolute(number / 1000.0)),
        "db" if own == "dB" => Some(Limit::Absolute(number)),
        _ => None,
    }
}

impl fmt::Display for Targets {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, parameter) in self.parameters().into_iter().enumerate() {
            let Some((limit, unit)) = self.written(parameter) else { continue };
            write!(f, "{}{} < {limit} {unit}", if index > 0 { ", " } else { "" }, parameter.short_name())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limit(text: &str, parameter: Parameter, value: Option<f64>) -> Option<f64> {
        let targets: Targets = text.parse().unwrap();
        targets.limit(ParameterPlace { row: 0, band: 0, parameter }, value)
    }

    #[test]
    fn limits_are_read_in_every_unit_of_their_figure() {
        let close = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 1e-12, "{a:?} {b}");
        close(limit("t30<1%", Parameter::T30, None), 0.2);
        close(limit("t30<20ms", Parameter::T30, Some(2.0)), 0.2);
        close(limit("T30 < 0.02 s", Parameter::T30, Some(2.0)), 0.2);
        close(limit("t20<0.5jnd", Parameter::T20, None), 0.5);
        close(limit("edt<5%,level<0.1dB", Parameter::Level, None.or(Some(70.0))), 0.1);
        close(limit("level<=0.1 dB", Parameter::Level, Some(70.0)), 0.1);
        close(limit("d50<1%", Parameter::DefinitionD50, Some(0.5)), 0.2);
        close(limit("ts<2ms", Parameter::CenterTime, Some(0.1)), 0.2);
        close(limit("ts<2%", Parameter::CenterTime, Some(0.1)), 0.2);
        assert_eq!(limit("t30<1%", Parameter::Level, Some(70.0)), None);
        assert_eq!(limit("t30<20ms", Parameter::T30, None), None);
    }

    #[test]
    fn limits_are_written_in_the_unit_that_they_were_given_in() {
        let targets: Targets = "t30<1%,ts<2ms,d50<1%,c80<0.2jnd,level<0.1dB".parse().unwrap();
        for (parameter, expected) in [
            (Parameter::T30, (1.0, "%")),
            (Parameter::CenterTime, (2.0, "ms")),
            (Parameter::DefinitionD50, (1.0, "%")),
            (Parameter::ClarityC80, (0.2, "JND")),
            (Parameter::Level, (0.1, "dB")),
        ] {
            let (limit, unit) = targets.written(parameter).unwrap();
            assert!((limit - expected.0).abs() < 1e-12 && unit == expected.1, "{limit} {unit}");
        }
        assert_eq!(targets.written(Parameter::EarlyDecayTime), None);
    }

    #[test]
    fn wrong_targets_say_what_is_right() {
        for (text, part) in [
            ("", "t30<1%"),
            ("t30", "PARAMETER<LIMIT"),
            ("t30>1%", "PARAMETER<LIMIT"),
            ("rt60<1%", "level, g, edt"),
            ("t30<1dB", "t30<1%"),
            ("level<1%", "level<0.1dB"),
            ("t30<1", "t30<1%"),
            ("d50<0.01", "the limit of d50 has no unit: write d50<1%"),
            ("t30<0%", "above 0"),
            ("t30<-1%", "above 0"),
            ("t30<nan%", "above 0"),
            ("t30<%", "above 0"),
            ("t30<1%,t30<2%", "two limits"),
            ("t30<1%,", "PARAMETER<LIMIT"),
        ] {
            let error = text.parse::<Targets>().unwrap_err().to_string();
            assert!(error.contains(part) && !error.contains('\n'), "{text}: {error}");
        }
    }

    #[test]
    fn targets_are_shown_in_their_units() {
        let targets: Targets = "t30<1%,ts<2ms,d50<1%,c80<0.2jnd".parse().unwrap();
        assert_eq!(targets.to_string(), "t30 < 1 %, ts < 2 ms, d50 < 1 %, c80 < 0.2 JND");
    }
}
