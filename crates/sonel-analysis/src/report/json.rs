//! JSON of docs/interface.md; further keys state the quality of every parameter.

use serde_json::{Value, json};
use sonel_acoustics::just_noticeable as noticeable;
use sonel_acoustics::noise::{NoiseCurve, RoomCriterion};

use crate::average::{average, single_number};
use crate::echo::ECHO_CRITERIA;
use crate::estimate::ParameterValue;
use crate::receiver::{BandParameters, ReceiverParameters, SpeechInNoise, shared};

/// `{"receivers": […], "means": […]}` of one response.
#[must_use]
pub fn json(parameters: &[ReceiverParameters]) -> Value {
    let mut whole = receivers(parameters);
    whole["means"] = means(parameters);
    whole
}

/// `{"receivers": […]}`.
#[must_use]
pub fn receivers(parameters: &[ReceiverParameters]) -> Value {
    json!({ "receivers": parameters.iter().map(receiver).collect::<Vec<_>>() })
}

fn receiver(receiver: &ReceiverParameters) -> Value {
    let mut fields = json!({
        "source": receiver.source,
        "name": receiver.name,
        "position_m": receiver.position,
        "speech_transmission_index": speech(&receiver.speech_transmission_index),
        "single_numbers": single_numbers(&[receiver]),
        "a_weighted_level_db": level(&receiver.a_weighted_level_db),
        "bands": receiver.bands.iter().map(band).collect::<Vec<_>>(),
    });
    let levels = receiver.octave_levels_db();
    let mut ratings = json!({});
    for (key, curve) in [("nr", NoiseCurve::Nr), ("nc", NoiseCurve::Nc)] {
        if let Some(rating) = curve.rating(&levels) {
            ratings[key] = json!(rating);
        }
    }
    if let Some(RoomCriterion { rating, rumbles, hisses }) = RoomCriterion::of(&levels) {
        ratings["rc"] = json!({ "rating": rating, "rumbles": rumbles, "hisses": hisses });
    }
    fields["noise_ratings"] = ratings;
    for (criterion, found) in ECHO_CRITERIA.iter().zip(&receiver.echo) {
        fields[criterion.key] = estimate(found);
        fields[criterion.key]["limit"] = json!(criterion.limit);
    }
    if let Some(SpeechInNoise { level_db, noise_level_db, signal_to_noise_db }) = &receiver.in_noise {
        fields["speech_level_db"] = level(level_db);
        fields["noise_level_db"] = json!(noise_level_db);
        fields["signal_to_noise_db"] = level(signal_to_noise_db);
    }
    fields
}

fn level(of: &ParameterValue) -> Value {
    noticed(of, |_| noticeable::LEVEL_DB)
}

/// The means of single numbers and of the speech transmission index over the receivers of every source, where there are several.
fn means(receivers: &[ReceiverParameters]) -> Value {
    let of_source = |group: &[ReceiverParameters]| {
        let group: Vec<&ReceiverParameters> = group.iter().collect();
        json!({
            "source": group[0].source,
            "receivers": group.len(),
            "speech_transmission_index": speech(&average(group.iter().map(|receiver| &receiver.speech_transmission_index))),
            "single_numbers": single_numbers(&group),
        })
    };
    let groups = receivers.chunk_by(|a, b| a.source == b.source);
    groups.filter(|group| group.len() > 1).map(of_source).collect()
}

/// Means over `receivers` of the single numbers that all of them have.
fn single_numbers(receivers: &[&ReceiverParameters]) -> Value {
    let fields = shared(receivers.iter().copied()).into_iter().map(|parameter| {
        let parameters: Vec<ParameterValue> =
            receivers.iter().map(|receiver| single_number(receiver, parameter)).collect();
        let found = match &parameters[..] {
            [one] => one.clone(),
            several => average(several),
        };
        (parameter.key().to_owned(), noticed(&found, |value| parameter.just_noticeable(value)))
    });
    Value::Object(fields.collect())
}

fn speech(index: &ParameterValue) -> Value {
    noticed(index, |_| noticeable::SPEECH_TRANSMISSION_INDEX)
}

fn band(band: &BandParameters) -> Value {
    let mut fields = json!({ "center_frequency_hz": band.center_frequency_hz });
    for parameter in band.parameters() {
        let just_noticeable = |value| parameter.just_noticeable(value);
        fields[parameter.key()] = noticed(band.parameter(parameter), just_noticeable);
    }
    fields
}

/// A parameter with its just-noticeable difference.
fn noticed(of: &ParameterValue, just_noticeable: impl Fn(f64) -> f64) -> Value {
    let mut fields = estimate(of);
    if let Ok(estimate) = of {
        fields["just_noticeable_difference"] = json!(just_noticeable(estimate.value));
    }
    fields
}

/// A parameter with its interval, or the reason why there is none; an end that is infinite is null.
#[must_use]
pub fn estimate(estimate: &ParameterValue) -> Value {
    let estimate = match estimate {
        Ok(estimate) => estimate,
        Err(reason) => return json!({ "value": null, "reason": reason.to_string() }),
    };
    let mut fields = json!({ "value": estimate.value });
    match &estimate.interval {
        Ok(interval) => fields["ci95"] = json!(interval),
        Err(reason) => {
            fields["ci95"] = Value::Null;
            fields["reason"] = json!(reason.to_string());
        }
    }
    if let Some(ends) = estimate.material_interval() {
        let by_material: Vec<f64> = estimate.materials.iter().map(|change| change.by_one).collect();
        fields["ci95_materials"] = json!(ends);
        fields["by_material"] = json!(by_material);
    }
    if let Some(warning) = &estimate.warning {
        fields["warning"] = json!(warning);
    }
    if let Some(decay) = &estimate.decay {
        fields["decay_range_db"] = json!(decay.range_db);
        fields["non_linearity_permille"] = json!(decay.non_linearity_permille);
        if let Some(curvature) = decay.curvature_percent {
            fields["curvature_percent"] = json!(curvature);
        }
    }
    fields
}
