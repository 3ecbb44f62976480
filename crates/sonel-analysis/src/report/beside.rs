//! Several responses side by side: a column for each, then differences from the first, as table, CSV and JSON.

use std::io::Write;

use serde_json::{Value, json};
use sonel_acoustics::just_noticeable as noticeable;

use super::csv::{numbers, text};
use super::table::{Notes, cell, of_materials};
use super::{aligned, estimate};
use crate::average::single_number;
use crate::cell;
use crate::comparison::{Pairing, Significance, difference};
use crate::estimate::ParameterValue;
use crate::parameter::Parameter;
use crate::receiver::{BandParameters, ReceiverParameters};
use crate::seats;

/// A response in a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Above the column.
    pub name: String,
    /// Its parameters.
    pub parameters: Vec<ReceiverParameters>,
    /// Relation of its errors to those of the first column.
    pub pairing: Pairing,
}

/// A value of every column.
struct ParameterRow {
    /// None for the single number, and for what has no bands.
    center_frequency_hz: Option<f64>,
    key: &'static str,
    /// Symbol, unit and what numbers are multiplied by in tables.
    heading: (&'static str, &'static str, f64),
    /// The parameter; none: the speech transmission index.
    parameter: Option<Parameter>,
    /// None where a response has no such source, receiver or band.
    values: Vec<Option<ParameterValue>>,
}

impl ParameterRow {
    fn just_noticeable(&self, value: f64) -> f64 {
        self.parameter
            .map_or(noticeable::SPEECH_TRANSMISSION_INDEX, |parameter| parameter.just_noticeable(value))
    }

    /// Differences of the later columns from the first, where both have the value, with what they mean.
    fn differences(&self, columns: &[Column]) -> Vec<Option<(ParameterValue, Significance)>> {
        let others = self.values.iter().zip(columns).skip(1);
        others
            .map(|(after, column)| {
                let (before, after) = (self.values[0].as_ref()?, after.as_ref()?);
                let found = difference(before, after, column.pairing);
                let least = self.just_noticeable(before.as_ref().ok()?.value);
                let significance = Significance::of(found.as_ref().ok()?, least);
                Some((found, significance))
            })
            .collect()
    }
}

/// A source at a receiver, or at the mean over receivers.
struct Block {
    source: String,
    receiver: Option<String>,
    rows: Vec<ParameterRow>,
}

/// Blocks of all sources and receivers of any column, in the order in which they come; of means one per source.
fn blocks(columns: &[Column], is_mean: bool) -> Vec<Block> {
    let mut pairs: Vec<(String, Option<String>)> = Vec::new();
    for receiver in columns.iter().flat_map(|column| &column.parameters) {
        let pair = (receiver.source.clone(), (!is_mean).then(|| receiver.name.clone()));
        if !pairs.contains(&pair) {
            pairs.push(pair);
        }
    }
    pairs.into_iter().map(|(source, receiver)| block(columns, source, receiver)).collect()
}

fn block(columns: &[Column], source: String, receiver: Option<String>) -> Block {
    let own: Vec<Vec<&ReceiverParameters>> = columns
        .iter()
        .map(|column| {
            let is_own = |found: &&ReceiverParameters| {
                found.source == source && receiver.as_ref().is_none_or(|name| *name == found.name)
            };
            column.parameters.iter().filter(is_own).collect()
        })
        .collect();
    let all = || own.iter().flatten();
    let mut parameters: Vec<Parameter> = Vec::new();
    let mut bands: Vec<f64> = Vec::new();
    for band in all().flat_map(|found| &found.bands) {
        parameters.extend(band.parameters().filter(|found| !parameters.contains(found)).collect::<Vec<_>>());
        if !bands.contains(&band.center_frequency_hz) {
            bands.push(band.center_frequency_hz);
        }
    }
    bands.sort_by(f64::total_cmp);
    let row = |parameter, center_frequency_hz, of: &dyn Fn(&ReceiverParameters) -> Option<ParameterValue>| {
        let values = own.iter().map(|receivers| {
            let values: Vec<ParameterValue> = receivers.iter().filter_map(|found| of(found)).collect();
            match &values[..] {
                [] => None,
                [one] => Some(one.clone()),
                several => Some(seats::spread(&several.iter().collect::<Vec<_>>()).mean),
            }
        });
        let known = |parameter: Parameter| (parameter.key(), parameter.heading());
        let (key, heading) =
            Option::map_or(parameter, ("speech_transmission_index", ("STI", "", 1.0)), known);
        ParameterRow { center_frequency_hz, key, heading, parameter, values: values.collect() }
    };
    let mut rows = Vec::new();
    for parameter in parameters {
        let has = |band: &BandParameters| band.parameters().any(|found| found == parameter);
        rows.extend(bands.iter().map(|hz| {
            row(Some(parameter), Some(*hz), &|found| {
                found.in_band(*hz, parameter).filter(|_| found.bands.iter().any(has))
            })
        }));
        rows.push(row(Some(parameter), None, &|found| Some(single_number(found, parameter))));
    }
    rows.push(row(None, None, &|found| Some(found.speech_transmission_index.clone())));
    Block { source, receiver, rows }
}

/// A block of a table side by side, as plain texts.
#[derive(Debug, Clone, PartialEq)]
pub struct BesideBlock {
    /// Name of the source.
    pub source: String,
    /// Name of the receiver; none: the mean over the receivers.
    pub receiver: Option<String>,
    /// Above the columns.
    pub head: Vec<String>,
    /// A row per parameter and band.
    pub rows: Vec<Vec<String>>,
}

/// A block per source and receiver, or per source with the mean over its receivers, a row per parameter and band; `write` writes a value, which is
/// multiplied by a factor for the unit of its heading.
pub fn beside_blocks(
    columns: &[Column],
    is_mean: bool,
    write: &mut dyn FnMut(&ParameterValue, f64) -> String,
) -> Vec<BesideBlock> {
    let names = columns.iter().map(|column| column.name.clone());
    let differences = columns.iter().skip(1).map(|column| format!("{} − {}", column.name, columns[0].name));
    let head: Vec<String> =
        ["", "f [Hz]"].map(str::to_owned).into_iter().chain(names).chain(differences).collect();
    let mut row = |row: &ParameterRow| {
        let (symbol, unit, factor) = row.heading;
        let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
        let hz = match (row.center_frequency_hz, row.parameter) {
            (Some(hz), _) => hz.to_string(),
            (None, Some(_)) => "single".to_owned(),
            (None, None) => String::new(),
        };
        let mut cells = vec![format!("{symbol}{unit}"), hz];
        cells.extend(
            row.values
                .iter()
                .map(|value| value.as_ref().map_or_else(String::new, |value| write(value, factor))),
        );
        cells.extend(row.differences(columns).into_iter().map(|found| match found {
            Some((found, significance)) => format!("{}{}", write(&found, factor), significance.mark()),
            None => "–".to_owned(),
        }));
        cells
    };
    blocks(columns, is_mean)
        .into_iter()
        .map(|Block { source, receiver, rows }| {
            let rows = rows.iter().map(&mut row).collect();
            BesideBlock { source, receiver, head: head.clone(), rows }
        })
        .collect()
}

/// Aligned text of [`beside_blocks`].
#[must_use]
pub fn beside_table(columns: &[Column], is_mean: bool) -> String {
    let mut notes = Notes::default();
    let mut text = String::new();
    for block in beside_blocks(columns, is_mean, &mut |value, factor| cell(value, factor, &mut notes)) {
        let place = match block.receiver {
            Some(name) => format!("at receiver \"{name}\""),
            None => "mean over the receivers".to_owned(),
        };
        let table = aligned(block.head, block.rows, 1..);
        text += &format!("source \"{}\" {place}\n{table}\n", block.source);
    }
    let materials = of_materials(columns.iter().flat_map(|column| &column.parameters));
    format!(
        "{text}±: half-width of the 95 % interval{materials}; of differences that of the simulation. (0): not beyond it. *: beyond it and at least one just-noticeable difference.\n{}",
        notes.text()
    )
}

/// Columns of [`beside_csv`].
const HEADER: &str = "source,receiver,center_frequency_hz,parameter,response,value,ci95_low,ci95_high,reason,difference,\
    difference_ci95_low,difference_ci95_high,difference_jnd";

/// A row per source, receiver, parameter, band and response, with the difference from the first response; means have no receiver.
///
/// # Errors
/// When `out` cannot be written.
pub fn beside_csv(columns: &[Column], is_mean: bool, out: impl Write) -> std::io::Result<()> {
    let mut writer = ::csv::Writer::from_writer(out);
    writer.write_record(HEADER.split(','))?;
    for Block { source, receiver, rows } in blocks(columns, is_mean) {
        for row in &rows {
            let differences = std::iter::once(None).chain(row.differences(columns));
            for ((value, difference), column) in row.values.iter().zip(differences).zip(columns) {
                let Some(value) = value else { continue };
                let [number, low, high, reason] = numbers(value);
                let [change, change_low, change_high, _] =
                    difference.as_ref().map_or_else(Default::default, |(found, _)| numbers(found));
                let noticed = text(difference.map(|(_, significance)| significance.just_noticeable));
                writer.write_record([
                    &*cell::of_name(&source),
                    &cell::of_name(receiver.as_deref().unwrap_or_default()),
                    &text(row.center_frequency_hz),
                    row.key,
                    &cell::of_name(&column.name),
                    &number,
                    &low,
                    &high,
                    &reason,
                    &change,
                    &change_low,
                    &change_high,
                    &noticed,
                ])?;
            }
        }
    }
    writer.flush()
}

/// Differences of the later columns from the first: `[{"response": …, "reference": …, "source": …, "receiver": …, "center_frequency_hz": …,
/// "parameter": …, "difference": F, "just_noticeable_differences": …, "beyond_noise": …}]`; of single numbers without a band.
#[must_use]
pub fn beside_json(columns: &[Column], is_mean: bool) -> Value {
    let mut all = Vec::new();
    for Block { source, receiver, rows } in blocks(columns, is_mean) {
        for row in &rows {
            for (found, column) in row.differences(columns).into_iter().zip(columns.iter().skip(1)) {
                let Some((found, significance)) = found else { continue };
                all.push(json!({
                    "response": column.name,
                    "reference": columns[0].name,
                    "source": source,
                    "receiver": receiver,
                    "center_frequency_hz": row.center_frequency_hz,
                    "parameter": row.key,
                    "difference": estimate(&found),
                    "just_noticeable_differences": significance.just_noticeable,
                    "beyond_noise": significance.is_beyond_noise,
                }));
            }
        }
    }
    Value::Array(all)
}
