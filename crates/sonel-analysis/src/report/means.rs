//! Means and standard deviations over receivers, as table, CSV and JSON.

use std::io::Write;

use serde_json::{Value, json};

use super::csv::{self, material_ends, numbers};
use super::table::{Notes, cell, digits, headings, of_materials};
use super::{aligned, estimate};
use crate::cell;
use crate::parameter::Parameter;
use crate::receiver::ReceiverParameters;
use crate::seats::{Spread, SpreadRow, rows};

/// Aligned text: a block per source, a row per band, each cell mean, half-width of its interval and standard deviation.
#[must_use]
pub fn means_table(parameters: &[ReceiverParameters], title: &str) -> String {
    let mut notes = Notes::default();
    let blocks: Vec<String> = parameters
        .chunk_by(|a, b| a.source == b.source)
        .map(|group| {
            let rows = rows(group);
            let spreads = rows.iter().take(1).flat_map(|row| &row.spreads);
            let head = headings(spreads.map(|(parameter, _)| parameter), []);
            let row = |row: &SpreadRow| {
                let band = row.center_frequency_hz.map_or_else(|| "single".to_owned(), |hz| hz.to_string());
                let cell = |(parameter, spread): &(Parameter, Spread)| {
                    text(spread, parameter.heading().2, &mut notes)
                };
                std::iter::once(band).chain(row.spreads.iter().map(cell)).collect::<Vec<_>>()
            };
            let table = aligned(head, rows.iter().map(row), ..);
            let (source, count) = (&group[0].source, group.len());
            let plural = if count == 1 { "" } else { "s" };
            format!("{title}source \"{source}\", mean over {count} receiver{plural}\n{table}")
        })
        .collect();
    let materials = of_materials(parameters);
    format!(
        "{}\n±: half-width of the 95 % interval of the mean over these receivers{materials}; sd: standard deviation between them\n{}",
        blocks.join("\n"),
        notes.text()
    )
}

fn text(spread: &Spread, factor: f64, notes: &mut Notes) -> String {
    let mean = cell(&spread.mean, factor, notes);
    let Some(deviation) = spread.deviation.map(|deviation| factor * deviation) else { return mean };
    let missing = match spread.of - spread.count {
        0 => String::new(),
        missing => notes.mark(&format!("{missing} of {} receivers have no value", spread.of)),
    };
    format!("{mean} sd {deviation:.*}{missing}", digits(deviation, deviation))
}

/// Columns of [`means_csv`].
const HEADER: &str = "source,center_frequency_hz,parameter,mean,ci95_low,ci95_high,standard_deviation,\
    receivers_with_value,receivers,reason,ci95_materials_low,ci95_materials_high";

/// A row per source, band and parameter; a row without a frequency is of single numbers.
///
/// # Errors
/// When `out` cannot be written.
pub fn means_csv(parameters: &[ReceiverParameters], out: impl Write) -> std::io::Result<()> {
    let mut writer = ::csv::Writer::from_writer(out);
    writer.write_record(HEADER.split(','))?;
    for group in parameters.chunk_by(|a, b| a.source == b.source) {
        for row in rows(group) {
            for (parameter, spread) in row.spreads {
                let [mean, low, high, reason] = numbers(&spread.mean);
                let [materials_low, materials_high] = material_ends(&spread.mean);
                writer.write_record([
                    cell::of_name(&group[0].source).into_owned(),
                    csv::text(row.center_frequency_hz),
                    parameter.key().to_owned(),
                    mean,
                    low,
                    high,
                    csv::text(spread.deviation),
                    spread.count.to_string(),
                    spread.of.to_string(),
                    reason,
                    materials_low,
                    materials_high,
                ])?;
            }
        }
    }
    writer.flush()
}

/// `[{"source": …, "receivers": N, "bands": […], "single_numbers": {…}}]`, each parameter with `standard_deviation` and `receivers_with_value`.
#[must_use]
pub fn means_json(parameters: &[ReceiverParameters]) -> Value {
    let of_source = |group: &[ReceiverParameters]| {
        let (mut bands, mut single) = (Vec::new(), json!({}));
        for row in rows(group) {
            let mut fields = json!({});
            for (parameter, spread) in &row.spreads {
                let mut value = estimate(&spread.mean);
                value["standard_deviation"] = json!(spread.deviation);
                value["receivers_with_value"] = json!(spread.count);
                fields[parameter.key()] = value;
            }
            match row.center_frequency_hz {
                Some(hz) => {
                    fields["center_frequency_hz"] = json!(hz);
                    bands.push(fields);
                }
                None => single = fields,
            }
        }
        json!({ "source": group[0].source, "receivers": group.len(), "bands": bands, "single_numbers": single })
    };
    parameters.chunk_by(|a, b| a.source == b.source).map(of_source).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::Estimate;

    /// `s` would be read as seconds.
    #[test]
    fn the_standard_deviation_is_not_called_as_a_unit() {
        let mean = Ok(Estimate::bare(1.25, Ok([1.15, 1.35])));
        let spread = Spread { mean, deviation: Some(0.2), count: 2, of: 2 };
        assert_eq!(text(&spread, 1.0, &mut Notes::default()), "1.25 ±0.10 sd 0.20");
    }
}
