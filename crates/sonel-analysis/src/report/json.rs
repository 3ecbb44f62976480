//! JSON as docs/interface.md has it, with the quality of every figure as further keys.

use serde_json::{Map, Value, json};
use sonel_acoustics::just_noticeable as noticeable;

use crate::figure::Figure;
use crate::parameter::Parameter;
use crate::receiver::{BandFigures, ReceiverFigures};

/// `{"receivers": […]}`.
#[must_use]
pub fn json(receivers: &[ReceiverFigures]) -> Value {
    json!({ "receivers": receivers.iter().map(receiver).collect::<Vec<_>>() })
}

fn receiver(receiver: &ReceiverFigures) -> Value {
    json!({
        "source": receiver.source,
        "name": receiver.name,
        "position_m": receiver.position,
        "speech_transmission_index": figure(&receiver.speech_transmission_index, |_| noticeable::SPEECH_TRANSMISSION_INDEX),
        "bands": receiver.bands.iter().map(band).collect::<Vec<_>>(),
    })
}

fn band(band: &BandFigures) -> Value {
    let mut fields = Map::new();
    fields.insert("center_frequency_hz".to_owned(), json!(band.center_frequency_hz));
    for parameter in Parameter::ALL {
        fields.insert(
            parameter.key().to_owned(),
            figure(band.figure(parameter), |value| parameter.just_noticeable(value)),
        );
    }
    Value::Object(fields)
}

fn figure(figure: &Figure, just_noticeable: impl Fn(f64) -> f64) -> Value {
    let estimate = match figure {
        Ok(estimate) => estimate,
        Err(reason) => return json!({ "value": null, "reason": reason.to_string() }),
    };
    let mut fields = Map::new();
    fields.insert("value".to_owned(), json!(estimate.value));
    match &estimate.interval {
        Ok(interval) => fields.insert("ci95".to_owned(), json!(interval)),
        Err(reason) => {
            fields.insert("ci95".to_owned(), Value::Null);
            fields.insert("reason".to_owned(), json!(reason.to_string()))
        }
    };
    fields.insert("just_noticeable_difference".to_owned(), json!(just_noticeable(estimate.value)));
    if let Some(warning) = &estimate.warning {
        fields.insert("warning".to_owned(), json!(warning));
    }
    if let Some(decay) = &estimate.decay {
        fields.insert("decay_range_db".to_owned(), json!(decay.range_db));
        fields.insert("non_linearity_permille".to_owned(), json!(decay.non_linearity_permille));
        if let Some(curvature) = decay.curvature_percent {
            fields.insert("curvature_percent".to_owned(), json!(curvature));
        }
    }
    Value::Object(fields)
}
