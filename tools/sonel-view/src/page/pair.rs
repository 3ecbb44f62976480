//! A source at a receiver as the page shows it: parameters with intervals, charts, and the ways of early reflections.

use serde_json::{Value, json};
use sonel::acoustics::just_noticeable::SPEECH_TRANSMISSION_INDEX;
use sonel::analysis::average::single_number;
use sonel::analysis::{ParameterValue, ReceiverParameters};
use sonel::drawing::plot::{self, Axis, Panel};
use sonel::echograms::Echograms;
use sonel::geometry::Geometry;

use super::single::half_width;
use super::{charts, reflections};

/// Source `s` at receiver `r` of a response with these parameters. Ways are followed between the walls `geometry`, where they are those that
/// the response was rendered with.
pub(crate) fn json(
    response: &Echograms,
    parameters: &ReceiverParameters,
    (s, r): (usize, usize),
    geometry: Option<&Geometry>,
) -> Value {
    let early = plot::early(response, (s, r), None).unwrap_or_else(|| Panel {
        title: "Early reflections: none are listed".to_owned(),
        x: Axis::linear("delay to the direct sound [ms]"),
        y: Axis::linear("strength of the arrival [dB]"),
        series: Vec::new(),
    });
    json!({
        "source": parameters.source,
        "receiver": parameters.name,
        "at": response.receiver_positions[r],
        "sourceAt": response.source_positions[s],
        "bands": response.center_frequency_hz,
        "parameters": rows(parameters),
        "decay": charts::of(&plot::decay(response, s, r)),
        "echogram": charts::of(&plot::echogram(response, s, r)),
        "early": charts::of(&early),
        "ways": geometry.map_or_else(Vec::new, |walls| reflections::json(response, walls, (s, r))),
    })
}

/// Every parameter over the bands and as a single number, in the unit of its heading; at last the speech transmission index.
fn rows(receiver: &ReceiverParameters) -> Vec<Value> {
    let mut rows: Vec<Value> = receiver
        .listed()
        .into_iter()
        .map(|parameter| {
            let (symbol, unit, factor) = parameter.heading();
            let single = single_number(receiver, parameter);
            let middle = single.as_ref().map_or(1.0, |estimate| estimate.value);
            let values = receiver.bands.iter().map(|band| value(band.parameter(parameter), factor));
            json!({
                "key": parameter.key(), "symbol": symbol, "unit": unit,
                "noticeable": factor * parameter.just_noticeable(middle),
                "single": value(&single, factor),
                "values": values.collect::<Vec<_>>(),
            })
        })
        .collect();
    rows.push(json!({
        "key": "speech_transmission_index", "symbol": "STI", "unit": "", "noticeable": SPEECH_TRANSMISSION_INDEX,
        "single": value(&receiver.speech_transmission_index, 1.0), "values": [],
    }));
    rows
}

/// Value and half-width of its interval; a reason where there is none.
pub(crate) fn value(value: &ParameterValue, factor: f64) -> Value {
    match value {
        Ok(estimate) => match half_width(estimate) {
            Ok(half) => json!([factor * estimate.value, factor * half]),
            Err(reason) => json!([factor * estimate.value, reason.to_string()]),
        },
        Err(reason) => json!(reason.to_string()),
    }
}
