//! `parameters --target`: the share of receivers within a range.

use serde_json::{Value, json};
use sonel_analysis::{ParameterValue, ReceiverParameters};
use sonel_study::criteria::{Criterion, Judged, Verdict, verdict};

/// Receivers of a source whose parameter lies in a range, in one band.
pub struct Share {
    target: String,
    symbol: &'static str,
    unit: &'static str,
    source: String,
    judged: Judged,
    /// In the unit of tables.
    range: [f64; 2],
    /// Receivers with a value, those whose value lies within, and those whose interval reaches over an end or is missing.
    with_value: usize,
    within: usize,
    undecided: usize,
    receivers: usize,
}

/// Every target in every band that it is about.
pub fn shares(targets: &[Criterion], parameters: &[ReceiverParameters], volume: Option<f64>) -> Vec<Share> {
    let mut shares = Vec::new();
    for target in targets {
        let (symbol, unit, factor) = target.parameter.heading();
        for group in parameters.chunk_by(|a, b| a.source == b.source) {
            let bands: Vec<f64> = group[0].bands.iter().map(|band| band.center_frequency_hz).collect();
            for judged in target.judged(&bands, volume) {
                let range = judged.range;
                let values =
                    group.iter().map(|receiver| judged.value(|hz| receiver.in_band(hz, target.parameter)));
                let values: Vec<ParameterValue> = values.collect();
                let values = values.iter();
                let known: Vec<_> = values.filter(|value| value.is_ok()).collect();
                let within = known.iter().filter(|value| {
                    value.as_ref().is_ok_and(|found| (range[0]..=range[1]).contains(&found.value))
                });
                let undecided =
                    known.iter().filter(|value| verdict(range, value) == Verdict::Undecided).count();
                shares.push(Share {
                    target: target.name.clone(),
                    symbol,
                    unit,
                    source: group[0].source.clone(),
                    judged: judged.clone(),
                    range: range.map(|end| factor * end),
                    with_value: known.len(),
                    within: within.count(),
                    undecided,
                    receivers: group.len(),
                });
            }
        }
    }
    shares
}

/// A line per band.
pub fn text(shares: &[Share]) -> String {
    let mut text = String::new();
    for Share { target, symbol, unit, source, judged, range, with_value, within, undecided, receivers } in
        shares
    {
        let [low, high] = range;
        let range = match (low.is_finite() && *low != 0.0, high.is_finite()) {
            (true, true) => format!("{low:.2} … {high:.2}"),
            (false, true) => format!("at most {high:.2}"),
            _ => format!("at least {low:.2}"),
        };
        let percent = 100.0 * *within as f64 / (*with_value).max(1) as f64;
        let missing = match receivers - with_value {
            0 => String::new(),
            missing => format!(", {missing} without a value"),
        };
        text.push_str(&format!(
            "target {target}, source \"{source}\", {judged} Hz: {symbol} {range} {unit} at {within} of {with_value} receivers ({percent:.0} %), \
             {undecided} undecided by their intervals{missing}\n"
        ));
    }
    text
}

/// As JSON.
pub fn json(shares: &[Share]) -> Value {
    let finite = |end: f64| end.is_finite().then_some(end);
    shares
        .iter()
        .map(|share| {
            json!({
                "target": share.target,
                "source": share.source,
                "center_frequency_hz": match share.judged.bands[..] { [hz] => Some(hz), _ => None },
                "mean_over_hz": (share.judged.bands.len() > 1).then_some(&share.judged.bands),
                "unit": share.unit,
                "range": share.range.map(finite),
                "receivers": share.receivers,
                "with_value": share.with_value,
                "within": share.within,
                "undecided": share.undecided,
            })
        })
        .collect()
}
