//! `parameters --target`: how many receivers pass, fail or are undecided.

use serde_json::{Value, json};
use sonel::analysis::{ParameterValue, ReceiverParameters};
use sonel::echograms::Provenance;
use sonel::study::criteria::{Criterion, DoesNotApply, Judged, Verdict, verdict};
use sonel_console::quantity;

/// A target at the receivers of a source.
pub(super) struct Share {
    target: Criterion,
    source: String,
    receivers: usize,
    /// In every band that it is about, or why it does not apply.
    bands: Result<Vec<Counts>, DoesNotApply>,
}

/// Receivers of each verdict, which add up with those without a value.
struct Counts {
    judged: Judged,
    pass: usize,
    fail: usize,
    undecided: usize,
    without_value: usize,
}

impl Counts {
    fn of(judged: Judged, target: &Criterion, receivers: &[ReceiverParameters]) -> Self {
        let values: Vec<ParameterValue> =
            receivers.iter().map(|receiver| target.value(&judged, receiver)).collect();
        let count = |wanted| {
            let known = values.iter().filter(|value| value.is_ok());
            known.filter(|value| verdict(judged.range, value) == wanted).count()
        };
        let [pass, fail, undecided] = [Verdict::Pass, Verdict::Fail, Verdict::Undecided].map(count);
        let without_value = receivers.len() - pass - fail - undecided;
        Self { judged, pass, fail, undecided, without_value }
    }
}

impl Share {
    /// Whether a receiver fails the target.
    pub(super) fn has_failed(&self) -> bool {
        self.bands.as_ref().is_ok_and(|bands| bands.iter().any(|counts| counts.fail > 0))
    }
}

/// Every target at the receivers of every source.
pub(super) fn shares(
    targets: &[Criterion],
    parameters: &[ReceiverParameters],
    room: &Provenance,
) -> Vec<Share> {
    let share = |target: &Criterion, group: &[ReceiverParameters]| {
        let bands: Vec<f64> = group[0].bands.iter().map(|band| band.center_frequency_hz).collect();
        let judged = target.judged(&bands, room);
        let counts =
            |judged: Vec<Judged>| judged.into_iter().map(|one| Counts::of(one, target, group)).collect();
        Share {
            target: target.clone(),
            source: group[0].source.clone(),
            receivers: group.len(),
            bands: judged.map(counts),
        }
    };
    let groups = || parameters.chunk_by(|a, b| a.source == b.source);
    targets.iter().flat_map(|target| groups().map(move |group| share(target, group))).collect()
}

/// A line per target, source and band.
pub(super) fn text(shares: &[Share]) -> String {
    let mut text = String::new();
    for Share { target, source, bands, .. } in shares {
        let begin = format!("target {}, source \"{source}\"", target.name);
        let bands = match bands {
            Ok(bands) => bands,
            Err(reason) => {
                text.push_str(&format!("{begin}: does not apply: {reason}\n"));
                continue;
            }
        };
        let (symbol, unit, factor) = target.quantity.heading();
        for Counts { judged, pass, fail, undecided, without_value } in bands {
            let at = if judged.bands.is_empty() { String::new() } else { format!(", {judged}") };
            let range = quantity::range(judged.range.map(|end| factor * end));
            let missing = match without_value {
                0 => String::new(),
                missing => format!(", {missing} without a value"),
            };
            text.push_str(&format!(
                "{begin}{at}: {symbol} {range} {unit}; receivers: {pass} pass, {fail} fail, {undecided} undecided{missing}\n"
            ));
        }
    }
    text
}

/// As JSON.
pub(super) fn json(shares: &[Share]) -> Value {
    let mut all = Vec::new();
    for Share { target, source, receivers, bands } in shares {
        let mut entry = json!({ "target": target.name, "source": source, "receivers": receivers });
        match bands {
            Ok(bands) => all.extend(bands.iter().map(|counts| band_json(entry.clone(), target, counts))),
            Err(reason) => {
                entry["does_not_apply"] = json!(reason.to_string());
                all.push(entry);
            }
        }
    }
    Value::Array(all)
}

fn band_json(mut entry: Value, target: &Criterion, counts: &Counts) -> Value {
    let Counts { judged, pass, fail, undecided, without_value } = counts;
    let (_, unit, factor) = target.quantity.heading();
    let finite = |end: f64| end.is_finite().then_some(factor * end);
    entry["center_frequency_hz"] = json!(if let [hz] = judged.bands[..] { Some(hz) } else { None });
    entry["mean_over_hz"] = json!((judged.bands.len() > 1).then_some(&judged.bands));
    entry["unit"] = json!(unit);
    entry["range"] = json!(judged.range.map(finite));
    entry["pass"] = json!(pass);
    entry["fail"] = json!(fail);
    entry["undecided"] = json!(undecided);
    entry["without_value"] = json!(without_value);
    entry
}
