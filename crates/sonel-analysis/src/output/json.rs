//! JSON as docs/interface.md states it: every figure is `{"value":…,"ci95":[lo,hi]}` or `{"value":null,"reason":…}`.
//!
//! More keys tell the quality: `decay_range_db`, `nonlinearity_permille`, `curvature_percent`, `jnd`, `warning`; `ci95` is null
//! with a `ci95_reason` where a value has no interval.

use serde_json::{Map, Value, json};

use crate::figure::{Estimate, Figure, Interval};
use crate::parameter::Parameter;
use crate::report::{Band, Pair, Report};
use sonel_acoustics::just_noticeable::SPEECH_TRANSMISSION_INDEX;

/// The whole report.
#[must_use]
pub fn json(report: &Report) -> Value {
    json!({
        "batches": report.batches,
        "receivers": report.pairs.iter().map(pair).collect::<Vec<Value>>(),
    })
}

fn pair(pair: &Pair) -> Value {
    json!({
        "source": pair.source,
        "name": pair.receiver,
        "position_m": pair.position,
        "direct_time_s": pair.direct_time,
        "speech_transmission_index": figure(&pair.speech_transmission_index, |_| SPEECH_TRANSMISSION_INDEX),
        "bands": pair.bands.iter().map(band).collect::<Vec<Value>>(),
    })
}

fn band(band: &Band) -> Value {
    let mut keys = Map::new();
    keys.insert("center_frequency_hz".into(), json!(band.center_frequency_hz));
    for (parameter, value) in band.figures() {
        keys.insert(parameter.key().into(), figure(value, |value| noticeable(parameter, value)));
    }
    keys.insert("record".into(), record(band));
    Value::Object(keys)
}

/// How far the decay curve can be believed, and what was added beyond the record.
fn record(band: &Band) -> Value {
    let depth = band.decay_depth_db.filter(|depth| depth.is_finite());
    match band.tail {
        None => json!({ "decay_depth_db": depth }),
        Some(Ok(tail)) => {
            json!({ "decay_depth_db": depth, "continued": true, "end_decay_time_s": 6.0 * std::f64::consts::LN_10 / tail.rate })
        }
        Some(Err(reason)) => {
            json!({ "decay_depth_db": depth, "continued": false, "reason": reason.to_string() })
        }
    }
}

fn noticeable(parameter: Parameter, value: f64) -> f64 {
    parameter.just_noticeable_difference(value)
}

fn figure(figure: &Figure, jnd: impl Fn(f64) -> f64) -> Value {
    match figure {
        Figure::Supported(estimate) => supported(estimate, jnd(estimate.value)),
        Figure::Unsupported { reason } => json!({ "value": null, "reason": reason }),
    }
}

fn supported(estimate: &Estimate, jnd: f64) -> Value {
    let mut keys = Map::new();
    keys.insert("value".into(), json!(estimate.value));
    match &estimate.interval {
        Interval::Known { low, high, .. } => {
            keys.insert("ci95".into(), json!([low, high]));
        }
        Interval::Unknown { reason } => {
            keys.insert("ci95".into(), Value::Null);
            keys.insert("ci95_reason".into(), json!(reason));
        }
    }
    keys.insert("jnd".into(), json!(jnd));
    if let Some(line) = estimate.line {
        keys.insert("decay_range_db".into(), json!([line.fit.range.from_db, line.fit.range.to_db]));
        keys.insert("nonlinearity_permille".into(), json!(line.fit.nonlinearity_permille));
        if let Some(curvature) = line.curvature_percent {
            keys.insert("curvature_percent".into(), json!(curvature));
        }
    }
    if let Some(warning) = &estimate.warning {
        keys.insert("warning".into(), json!(warning));
    }
    Value::Object(keys)
}
