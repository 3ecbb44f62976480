//! What a room shall meet, and whether it does: the mean over the receivers, with its distance to the required range.

use serde::Serialize;
use sonel::analysis::seats::spread;
use sonel::analysis::{Estimate, ParameterValue};
use sonel::study::criteria::{Criterion, Judged, Verdict, verdict};

use super::Subject;
use super::number::Number;

/// A requirement and what every design makes of it.
#[derive(Debug, Serialize)]
pub(crate) struct Requirement {
    /// As it was written.
    pub name: String,
    pub key: &'static str,
    pub symbol: &'static str,
    pub unit: &'static str,
    /// Title and source of a standard.
    pub source: String,
    /// The state of the room in which it holds.
    pub state: &'static str,
    /// Lowest and highest value in each band of the first design; none where it says nothing.
    pub ranges: Vec<Option<[f64; 2]>>,
    /// In the order of the designs.
    pub designs: Vec<Judgement>,
}

/// What becomes of a requirement in a design.
#[derive(Debug, Serialize)]
pub(crate) struct Judgement {
    /// Pass, fail or undecided in all bands together; why it does not apply.
    pub verdict: String,
    pub bands: Vec<JudgedBand>,
}

/// A value that is judged.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct JudgedBand {
    /// Band or bands; empty for a quantity without.
    pub at: String,
    pub range: [f64; 2],
    pub value: Number,
    /// How far it lies outside of the range, beyond the nearer end, with the interval that is judged; negative inside.
    pub beyond: Number,
    /// Whether the upper end is the nearer one.
    pub is_above: bool,
    pub verdict: String,
}

impl Requirement {
    pub(super) fn of(target: &Criterion, subjects: &[Subject]) -> Self {
        let (symbol, unit, factor) = target.quantity.heading();
        let first = subjects[0].echograms();
        let range =
            |hz: &f64| target.range(*hz, &first.provenance).map(|range| range.map(|end| factor * end));
        Self {
            name: target.name.clone(),
            key: target.quantity.key(),
            symbol,
            unit,
            source: target.source(),
            state: target.state(),
            ranges: first.center_frequency_hz.iter().map(range).collect(),
            designs: subjects.iter().map(|subject| judgement(target, subject)).collect(),
        }
    }

    /// Whether a design fails it.
    pub(super) fn has_failed(&self) -> bool {
        self.designs.iter().any(|design| design.verdict == Verdict::Fail.to_string())
    }
}

fn judgement(target: &Criterion, subject: &Subject) -> Judgement {
    let factor = target.quantity.heading().2;
    let judged = match target
        .judged(&subject.echograms().center_frequency_hz, &subject.echograms().provenance)
    {
        Ok(judged) => judged,
        Err(reason) => return Judgement { verdict: format!("does not apply: {reason}"), bands: Vec::new() },
    };
    let mut verdicts = Vec::new();
    let band = |judged: &Judged| {
        let values: Vec<ParameterValue> =
            subject.parameters.iter().map(|receiver| target.value(judged, receiver)).collect();
        let mean = spread(&values.iter().collect::<Vec<_>>()).mean;
        let found = verdict(judged.range, &mean);
        verdicts.push(found);
        let (beyond, is_above) = beyond(judged.range, &mean);
        JudgedBand {
            at: judged.to_string(),
            range: judged.range.map(|end| factor * end),
            value: Number::of(&mean, factor),
            beyond: Number::of(&beyond, factor),
            is_above,
            verdict: found.to_string(),
        }
    };
    let bands = judged.iter().map(band).collect();
    let worst = [Verdict::Fail, Verdict::Undecided].into_iter().find(|worst| verdicts.contains(worst));
    Judgement { verdict: worst.unwrap_or(Verdict::Pass).to_string(), bands }
}

/// Distance of a value to the nearer end of a range, positive outside of it, and whether this end is the upper one.
fn beyond([low, high]: [f64; 2], value: &ParameterValue) -> (ParameterValue, bool) {
    let Ok(estimate) = value else { return (value.clone(), false) };
    let is_above = estimate.value - high > low - estimate.value;
    let of = |value: f64| if is_above { value - high } else { low - value };
    let interval = estimate.whole_interval().map(|ends| {
        let [a, b] = ends.map(of);
        [a.min(b), a.max(b)]
    });
    (Ok(Estimate::bare(of(estimate.value), interval)), is_above)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_is_that_to_the_nearer_end_with_its_interval() {
        let time = |value: f64| Ok(Estimate::bare(value, Ok([value - 0.02, value + 0.03])));
        for (value, range, distance, above) in [
            (0.77, [0.5, 0.7], 0.07, true),
            (0.42, [0.5, 0.7], 0.08, false),
            (0.68, [0.5, 0.7], -0.02, true),
            (0.4, [f64::NEG_INFINITY, 0.7], -0.3, true),
            (0.4, [0.3, f64::INFINITY], -0.1, false),
        ] {
            let (found, is_above) = beyond(range, &time(value));
            let found = found.unwrap();
            let [low, high] = found.interval.clone().unwrap();
            assert!((found.value - distance).abs() < 1e-12 && is_above == above, "{found:?}");
            assert!(low < found.value && (high - low - 0.05).abs() < 1e-12, "{found:?}");
        }
    }
}
