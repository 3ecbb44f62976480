//! CSV with one row per parameter.

use std::io::Write;

use crate::cell;
use crate::estimate::{DecayQuality, Estimate, ParameterValue};
use crate::receiver::ReceiverParameters;

/// Columns of [`csv`].
const HEADER: &str = "source,receiver,center_frequency_hz,parameter,value,ci95_low,ci95_high,warning,reason,\
    just_noticeable_difference,decay_range_db,non_linearity_permille,curvature_percent,source_x_m,\
    source_y_m,source_z_m,receiver_x_m,receiver_y_m,receiver_z_m,ci95_materials_low,ci95_materials_high";

/// Writes all parameters, one a row; what a parameter has not is an empty field. The speech transmission index has no band.
///
/// # Errors
/// When `out` cannot be written.
pub fn csv(receivers: &[ReceiverParameters], out: impl Write) -> std::io::Result<()> {
    let mut writer = ::csv::Writer::from_writer(out);
    writer.write_record(HEADER.split(','))?;
    for receiver in receivers {
        let places = [receiver.source_position, receiver.position];
        let mut pairs = receiver.source_position.iter().zip(receiver.position);
        let is_known = pairs.any(|(from, to)| from.total_cmp(&to).is_ne());
        let place = |value: &f64| if is_known { value.to_string() } else { String::new() };
        let places: Vec<String> = places.as_flattened().iter().map(place).collect();
        // A measurement does not say where it was made: its source is any.
        let source = if is_known { cell::of_name(&receiver.source) } else { Default::default() };
        let name = cell::of_name(&receiver.name);
        let mut write = |frequency: &str, key: &str, value: &ParameterValue, least: Option<f64>| {
            let (names, [number, low, high, reason]) = ([&source, &name, frequency, key], numbers(value));
            let known = value.as_ref().ok();
            let warning = text(known.and_then(|estimate| estimate.warning.as_ref()));
            let fields = [number, low, high, warning, reason, text(known.and(least))];
            let fields = fields.into_iter().chain(quality(known.and_then(|estimate| estimate.decay)));
            let fields = fields.chain(places.iter().cloned()).chain(material_ends(value));
            writer.write_record(names.into_iter().map(str::to_owned).chain(fields))
        };
        for (key, value, least) in receiver.over_bands() {
            write("", key, value, least)?;
        }
        for band in &receiver.bands {
            let frequency = band.center_frequency_hz.to_string();
            for parameter in band.parameters() {
                let value = band.parameter(parameter);
                let least = value.as_ref().ok().map(|known| parameter.just_noticeable(known.value));
                write(&frequency, parameter.key(), value, least)?;
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

/// Value, ends of its interval, and why one of them is missing.
pub(super) fn numbers(value: &ParameterValue) -> [String; 4] {
    let interval = value
        .as_ref()
        .map_err(ToString::to_string)
        .and_then(|estimate| estimate.interval.as_ref().map_err(ToString::to_string));
    let [low, high] = [0, 1].map(|end| text(interval.as_ref().ok().map(|ends| ends[end])));
    [text(value.as_ref().ok().map(|estimate| estimate.value)), low, high, text(interval.err())]
}

/// Range, non-linearity and curvature of a decay.
fn quality(decay: Option<DecayQuality>) -> [String; 3] {
    [
        text(decay.map(|DecayQuality { range_db: [from, to], .. }| format!("{from}:{to}"))),
        text(decay.map(|decay| decay.non_linearity_permille)),
        text(decay.and_then(|decay| decay.curvature_percent)),
    ]
}

/// An empty field where there is nothing.
pub(super) fn text(value: Option<impl ToString>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}
