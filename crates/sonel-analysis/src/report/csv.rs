//! CSV with one row per parameter.

use std::io::Write;

use sonel_acoustics::just_noticeable as noticeable;

use crate::cell;
use crate::echo::ECHO_CRITERIA;
use crate::estimate::{Estimate, ParameterValue};
use crate::receiver::ReceiverParameters;

/// Columns of [`csv`].
const HEADER: [&str; 21] = [
    "source",
    "receiver",
    "center_frequency_hz",
    "parameter",
    "value",
    "ci95_low",
    "ci95_high",
    "warning",
    "reason",
    "just_noticeable_difference",
    "decay_range_db",
    "non_linearity_permille",
    "curvature_percent",
    "source_x_m",
    "source_y_m",
    "source_z_m",
    "receiver_x_m",
    "receiver_y_m",
    "receiver_z_m",
    "ci95_materials_low",
    "ci95_materials_high",
];

/// Writes all parameters, one a row; what a parameter has not is an empty field. The speech transmission index has no band.
///
/// # Errors
/// When `out` cannot be written.
pub fn csv(receivers: &[ReceiverParameters], out: impl Write) -> std::io::Result<()> {
    let mut writer = ::csv::Writer::from_writer(out);
    writer.write_record(HEADER)?;
    for receiver in receivers {
        let places = [receiver.source_position, receiver.position];
        let mut pairs = receiver.source_position.iter().zip(receiver.position);
        let is_known = pairs.any(|(from, to)| from.total_cmp(&to).is_ne());
        let place = |value: &f64| if is_known { value.to_string() } else { String::new() };
        let places: Vec<String> = places.as_flattened().iter().map(place).collect();
        // A measurement does not say where it was made: its source is any.
        let source = if is_known { cell::of_name(&receiver.source) } else { Default::default() };
        let mut write = |frequency: &str,
                         key: &str,
                         estimate: &ParameterValue,
                         just_noticeable: &dyn Fn(f64) -> f64| {
            let names = [&source, &cell::of_name(&receiver.name), frequency, key];
            writer.write_record(
                row(names, estimate, just_noticeable).iter().chain(&places).chain(&material_ends(estimate)),
            )
        };
        write("", "speech_transmission_index", &receiver.speech_transmission_index, &|_| {
            noticeable::SPEECH_TRANSMISSION_INDEX
        })?;
        let level = |_| noticeable::LEVEL_DB;
        write("", "a_weighted_level_db", &receiver.a_weighted_level_db, &level)?;
        for (criterion, found) in ECHO_CRITERIA.iter().zip(&receiver.echo) {
            write("", criterion.key, found, &|_| f64::NAN)?;
        }
        if let Some(speech) = &receiver.in_noise {
            write("", "speech_level_db", &speech.level_db, &level)?;
            write("", "signal_to_noise_db", &speech.signal_to_noise_db, &level)?;
        }
        for band in &receiver.bands {
            let frequency = band.center_frequency_hz.to_string();
            for parameter in band.parameters() {
                let just_noticeable = |value| parameter.just_noticeable(value);
                write(&frequency, parameter.key(), band.parameter(parameter), &just_noticeable)?;
            }
        }
    }
    writer.flush()
}

/// Ends of the interval of the materials, or empty fields.
pub(super) fn material_ends(estimate: &ParameterValue) -> [String; 2] {
    let ends = estimate.as_ref().ok().and_then(Estimate::material_interval);
    ends.map_or([const { String::new() }; 2], |ends| ends.map(|end| end.to_string()))
}

fn row(names: [&str; 4], estimate: &ParameterValue, just_noticeable: &dyn Fn(f64) -> f64) -> [String; 13] {
    let [source, receiver, frequency, key] = names.map(str::to_owned);
    let mut fields = [const { String::new() }; 9];
    let [value, low, high, warning, reason, noticeable, quality @ ..] = &mut fields;
    match estimate {
        Err(why) => *reason = why.to_string(),
        Ok(estimate) => {
            *value = estimate.value.to_string();
            *warning = estimate.warning.clone().unwrap_or_default();
            let least = just_noticeable(estimate.value);
            *noticeable = if least.is_nan() { String::new() } else { least.to_string() };
            match &estimate.interval {
                Ok(interval) => [*low, *high] = interval.map(|limit| limit.to_string()),
                Err(why) => *reason = why.to_string(),
            }
            if let Some(decay) = &estimate.decay {
                let [from, to] = decay.range_db;
                let range = format!("{from}:{to}");
                let curvature = decay.curvature_percent.map(|curvature| curvature.to_string());
                *quality = [range, decay.non_linearity_permille.to_string(), curvature.unwrap_or_default()];
            }
        }
    }
    let [value, low, high, warning, reason, noticeable, range, non_linearity, curvature] = fields;
    [
        source,
        receiver,
        frequency,
        key,
        value,
        low,
        high,
        warning,
        reason,
        noticeable,
        range,
        non_linearity,
        curvature,
    ]
}
