//! Values as pages have them, in the unit of their heading.

use serde::Serialize;
use sonel::analysis::ParameterValue;

/// A value, or why there is none.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Number {
    /// Why there is none.
    Missing(String),
    /// With the interval of the simulation.
    Simulated(f64, Half),
    /// Also with the distances of the ends of the interval of the materials, infinite (null) where a decay may stop.
    WithMaterials(f64, Half, [f64; 2]),
}

/// Half-width of a 95 % interval, on its wider side: if the run ends early, it is not symmetric.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Half {
    /// In the unit of the value.
    Width(f64),
    /// Why there is none.
    Unknown(String),
}

impl Number {
    /// `value` times `factor`, with its intervals.
    pub(crate) fn of(value: &ParameterValue, factor: f64) -> Self {
        let estimate = match value {
            Ok(estimate) => estimate,
            Err(reason) => return Self::Missing(reason.to_string()),
        };
        let (value, beside) = (estimate.value, |end: &f64| factor * (end - estimate.value).abs());
        let half = match &estimate.interval {
            Ok([low, high]) => Half::Width(beside(low).max(beside(high))),
            Err(reason) => Half::Unknown(reason.to_string()),
        };
        match estimate.material_interval() {
            Some([low, high]) => Self::WithMaterials(factor * value, half, [beside(&low), beside(&high)]),
            None => Self::Simulated(factor * value, half),
        }
    }
}
