//! Content of a response as text and JSON.

use std::fmt::Write;

use serde_json::{Value, json};
use sonel::echograms::{ArrivalKind, Echograms};
use sonel_console::quantity::{counted, list};

/// The kinds of arrivals by name.
const KINDS: [(ArrivalKind, &str); 3] = [
    (ArrivalKind::Direct, "direct"),
    (ArrivalKind::ImageSource, "image_source"),
    (ArrivalKind::Edge, "edge"),
];

/// Longest value of a key of the provenance that is printed as it is, in characters.
const LONGEST: usize = 200;

/// The response as JSON.
pub(super) fn json(response: &Echograms) -> Value {
    let station = |(name, position): (&String, &[f64; 3])| json!({ "name": name, "position_m": position });
    let arrivals: serde_json::Map<String, Value> = arrivals(response)
        .map(|(name, count)| (name.to_owned(), json!(count)))
        .chain([("total".to_owned(), json!(response.arrivals.source.len()))])
        .collect();
    json!({
        "kind": "response",
        "center_frequency_hz": response.center_frequency_hz,
        "duration_s": duration(response),
        "time_bins": response.bins(),
        "sources": response.source_names.iter().zip(&response.source_positions).map(station).collect::<Vec<_>>(),
        "receivers": response.receiver_names.iter().zip(&response.receiver_positions).map(station).collect::<Vec<_>>(),
        "source_power_level_db": response.source_power_level_db.chunks(response.bands().max(1)).collect::<Vec<_>>(),
        "speed_of_sound": response.speed_of_sound,
        "characteristic_impedance": response.characteristic_impedance,
        "batches": {
            "count": response.batch_count(),
            "time_bins": response.batches.as_ref().map_or(0, |batches| batches.bins),
        },
        "arrivals": arrivals,
        "metadata": response.provenance.to_json(),
    })
}

/// In words.
pub(super) fn text(response: &Echograms) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{name:<17}{value}");
    };
    let (bins, duration) = (response.bins(), duration(response));
    let sources = counted(response.sources(), "source");
    line("response", format!("{sources}, {}", counted(response.receivers(), "receiver")));
    line("bands", format!("{} Hz", list(&response.center_frequency_hz)));
    line("time", format!("{duration} s in {bins} bins of {:.4} s on average", duration / bins.max(1) as f64));
    line(
        "air",
        format!(
            "c = {:.2} m/s, ρc = {:.2} Pa·s/m",
            response.speed_of_sound, response.characteristic_impedance
        ),
    );
    let batches = response.batches.as_ref();
    line(
        "batches",
        batches.map_or("none: parameters carry no interval".to_owned(), |batches| {
            format!("{} in {} coarse bins", batches.weight.len(), batches.bins)
        }),
    );
    let kinds: Vec<String> = arrivals(response).map(|(name, count)| format!("{count} {name}")).collect();
    line("arrivals", kinds.join(", "));
    for (s, (name, position)) in response.source_names.iter().zip(&response.source_positions).enumerate() {
        let b = response.bands();
        let levels = &response.source_power_level_db[s * b..(s + 1) * b];
        line("source", format!("{name} at ({}) m, {} dB re 1 pW", list(position), list(levels)));
    }
    for (r, (name, position)) in response.receiver_names.iter().zip(&response.receiver_positions).enumerate()
    {
        let directivity = response
            .receiver_directivities
            .get(r)
            .map_or(String::new(), |found| format!(", {} towards ({})", found.name, list(&found.aim)));
        line("receiver", format!("{name} at ({}) m{directivity}", list(position)));
    }
    if let Value::Object(keys) = response.provenance.to_json() {
        for (key, value) in keys {
            let text = value.to_string();
            match text.chars().count() {
                count if count > LONGEST => line(&key, format!("{count} characters: see --json")),
                _ => line(&key, text),
            }
        }
    }
    text
}

fn duration(response: &Echograms) -> f64 {
    response.time_edges_s.last().copied().unwrap_or(0.0)
}

fn arrivals(response: &Echograms) -> impl Iterator<Item = (&'static str, usize)> + '_ {
    KINDS.iter().map(|(kind, name)| {
        let code = *kind as u32;
        (*name, response.arrivals.kind.iter().filter(|found| **found == code).count())
    })
}
