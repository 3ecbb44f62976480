//! One row per figure: what a spreadsheet or a data frame reads without further words.

use std::io::Write;

use crate::figure::Figure;
use crate::parameter::Parameter;
use crate::receiver::ReceiverFigures;

/// Columns of [`csv`].
const HEADER: [&str; 9] = [
    "source",
    "receiver",
    "center_frequency_hz",
    "parameter",
    "value",
    "ci95_low",
    "ci95_high",
    "warning",
    "reason",
];

/// Writes all figures, one a row; what a figure has not is an empty field. The speech transmission index has no band.
///
/// # Errors
/// When `out` cannot be written.
pub fn csv(receivers: &[ReceiverFigures], out: impl Write) -> std::io::Result<()> {
    let mut writer = ::csv::Writer::from_writer(out);
    writer.write_record(HEADER)?;
    for receiver in receivers {
        let mut write = |frequency: &str, key: &str, figure: &Figure| {
            writer.write_record(row([&receiver.source, &receiver.name, frequency, key], figure))
        };
        write("", "speech_transmission_index", &receiver.speech_transmission_index)?;
        for band in &receiver.bands {
            let frequency = band.center_frequency_hz.to_string();
            for parameter in Parameter::ALL {
                write(&frequency, parameter.key(), band.figure(parameter))?;
            }
        }
    }
    writer.flush()
}

fn row(names: [&str; 4], figure: &Figure) -> [String; 9] {
    let (mut value, mut low, mut high) = (String::new(), String::new(), String::new());
    let (mut warning, mut reason) = (String::new(), String::new());
    match figure {
        Err(why) => reason = why.to_string(),
        Ok(estimate) => {
            value = estimate.value.to_string();
            warning = estimate.warning.clone().unwrap_or_default();
            match &estimate.interval {
                Ok(interval) => [low, high] = interval.map(|limit| limit.to_string()),
                Err(why) => reason = why.to_string(),
            }
        }
    }
    let [source, receiver, frequency, key] = names.map(str::to_owned);
    [source, receiver, frequency, key, value, low, high, warning, reason]
}
