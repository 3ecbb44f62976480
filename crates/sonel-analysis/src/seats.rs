//! Means and standard deviations of a parameter over receivers.
//!
//! The interval is that of the mean over these receivers. The standard deviation is that of their values: it has the differences between seats and
//! the noise of the simulation. Receivers without a value are left out and counted.

use crate::average::{average, single_number};
use crate::estimate::ParameterValue;
use crate::parameter::Parameter;
use crate::receiver::{ReceiverParameters, shared};

/// A parameter over several receivers.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Arithmetic mean of those with a value; without any, the reason of the first.
    pub mean: ParameterValue,
    /// Standard deviation (n − 1) of those values; none below two.
    pub deviation: Option<f64>,
    /// Receivers with a value.
    pub count: usize,
    /// All receivers.
    pub of: usize,
}

/// The spread of `values`, one per receiver.
#[must_use]
pub fn spread(values: &[&ParameterValue]) -> Spread {
    let known = values.iter().copied().filter(|value| value.is_ok());
    let numbers: Vec<f64> =
        known.clone().filter_map(|value| value.as_ref().ok()).map(|estimate| estimate.value).collect();
    let count = numbers.len();
    let mean = match values.first() {
        Some(first) if count == 0 => (*first).clone(),
        _ => average(known),
    };
    let middle = numbers.iter().sum::<f64>() / count.max(1) as f64;
    let squares: f64 = numbers.iter().map(|number| (number - middle) * (number - middle)).sum();
    let deviation = (count > 1).then(|| (squares / (count - 1) as f64).sqrt());
    Spread { mean, deviation, count, of: values.len() }
}

/// Spreads of the parameters that every receiver of a group has.
#[derive(Debug, Clone, PartialEq)]
pub struct SpreadRow {
    /// Band [Hz]; none: the single number.
    pub center_frequency_hz: Option<f64>,
    /// Each parameter.
    pub spreads: Vec<(Parameter, Spread)>,
}

/// Rows of the receivers of one source: its bands, then single numbers.
#[must_use]
pub fn rows(group: &[ReceiverParameters]) -> Vec<SpreadRow> {
    let Some(first) = group.first() else { return Vec::new() };
    let shared = shared(group);
    let row = |center_frequency_hz, of: &dyn Fn(&ReceiverParameters, Parameter) -> ParameterValue| {
        let spreads = shared.iter().map(|&parameter| {
            let values: Vec<ParameterValue> = group.iter().map(|receiver| of(receiver, parameter)).collect();
            (parameter, spread(&values.iter().collect::<Vec<_>>()))
        });
        SpreadRow { center_frequency_hz, spreads: spreads.collect() }
    };
    let bands = (0..first.bands.len()).map(|b| {
        row(Some(first.bands[b].center_frequency_hz), &|receiver, parameter| {
            receiver.bands[b].parameter(parameter).clone()
        })
    });
    bands.chain([row(None, &single_number)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::{Estimate, Unsupported};

    #[test]
    fn receivers_without_a_value_are_counted_and_the_deviation_is_that_of_the_others() {
        let value = |value| Ok(Estimate::bare(value, Ok([value - 0.1, value + 0.1])));
        let (missing, values) = (Err(Unsupported::NoReverberation), [2.0, 4.0, 4.0, 6.0].map(value));
        let mut all: Vec<&ParameterValue> = values.iter().collect();
        all.insert(0, &missing);
        let found = spread(&all);
        assert_eq!((found.count, found.of, found.mean.unwrap().value), (4, 5, 4.0));
        assert!((found.deviation.unwrap() - (8.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(spread(&[&missing]).mean, missing);
        assert_eq!(spread(&[&values[0]]).deviation, None);
    }
}
