//! CSV, one figure a row: easy to filter, and reasons have a place.

use std::io::Write;

use crate::figure::{Figure, Interval};
use crate::report::{Pair, Report};

const HEADER: [&str; 12] = [
    "source",
    "receiver",
    "x_m",
    "y_m",
    "z_m",
    "center_frequency_hz",
    "parameter",
    "value",
    "ci95_low",
    "ci95_high",
    "reason",
    "warning",
];

/// Writes the whole report with a header row. The speech transmission index has no centre frequency.
///
/// # Errors
/// When `out` cannot be written.
pub fn csv(report: &Report, out: &mut dyn Write) -> std::io::Result<()> {
    let mut rows = csv::Writer::from_writer(out);
    rows.write_record(HEADER)?;
    for pair in &report.pairs {
        rows.write_record(row(pair, "", "speech_transmission_index", &pair.speech_transmission_index))?;
        for band in &pair.bands {
            let center = band.center_frequency_hz.to_string();
            for (parameter, figure) in band.figures() {
                rows.write_record(row(pair, &center, parameter.key(), figure))?;
            }
        }
    }
    rows.flush()
}

fn row(pair: &Pair, center: &str, parameter: &str, figure: &Figure) -> [String; 12] {
    let [x, y, z] = pair.position.map(|coordinate| coordinate.to_string());
    let (mut value, mut low, mut high) = (String::new(), String::new(), String::new());
    let (mut reason, mut warning) = (String::new(), String::new());
    match figure {
        Figure::Supported(estimate) => {
            value = estimate.value.to_string();
            warning = estimate.warning.clone().unwrap_or_default();
            match &estimate.interval {
                Interval::Known { low: from, high: to, .. } => (low, high) = (from.to_string(), to.to_string()),
                Interval::Unknown { reason: why } => reason.clone_from(why),
            }
        }
        Figure::Unsupported { reason: why } => reason.clone_from(why),
    }
    let (source, receiver) = (pair.source.clone(), pair.receiver.clone());
    [source, receiver, x, y, z, center.into(), parameter.into(), value, low, high, reason, warning]
}
