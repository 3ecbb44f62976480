//! The table for people: one block a source and receiver, one row a band, reasons as notes below.

use std::fmt::Write;

use comfy_table::{CellAlignment, Table, presets};

use crate::figure::{Figure, Interval};
use crate::parameter::Parameter;
use crate::report::{Pair, Report};

/// Digits after the point of a speech transmission index.
const INDEX_DIGITS: usize = 3;

/// The whole report.
#[must_use]
pub fn table(report: &Report) -> String {
    let mut text = format!(
        "Room-acoustic parameters (ISO 3382-1) of {}: value ± half of the 95 % interval, {}.\n",
        count(report.pairs.len(), "source–receiver pair"),
        if report.batches > 1 {
            format!("from a jackknife over {} batches", report.batches)
        } else {
            "which is unknown here".to_owned()
        },
    );
    for pair in &report.pairs {
        block(pair, &mut text);
    }
    text
}

fn block(pair: &Pair, text: &mut String) {
    let [x, y, z] = pair.position;
    let mut notes = Notes::default();
    let index = cell(&pair.speech_transmission_index, 1.0, INDEX_DIGITS, &mut notes);
    let mut table = Table::new();
    table.load_preset(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header(std::iter::once("f [Hz]").chain(Parameter::ALL.map(Parameter::heading)));
    for band in &pair.bands {
        let mut row = vec![band.center_frequency_hz.to_string()];
        for (parameter, figure) in band.figures() {
            row.push(cell(figure, parameter.heading_scale(), digits(parameter), &mut notes));
        }
        table.add_row(row);
    }
    table.column_iter_mut().for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "\nSource {}, receiver {} at ({x}, {y}, {z}) m, direct sound at {:.1} ms, STI {index}",
        pair.source,
        pair.receiver,
        1000.0 * pair.direct_time
    );
    let _ = writeln!(text, "{}", table.trim_fmt());
    for (number, note) in notes.texts.iter().enumerate() {
        let _ = writeln!(text, "  ({}) {note}", number + 1);
    }
}

fn digits(parameter: Parameter) -> usize {
    match parameter {
        Parameter::EarlyDecayTime | Parameter::T20 | Parameter::T30 | Parameter::DefinitionD50 => 3,
        Parameter::Level | Parameter::Strength | Parameter::ClarityC50 | Parameter::ClarityC80 => 2,
        Parameter::CenterTime => 1,
    }
}

/// What the cells refer to by number.
#[derive(Default)]
struct Notes {
    texts: Vec<String>,
}

impl Notes {
    /// Number of `text`, added if it is new.
    fn number(&mut self, text: &str) -> usize {
        let known = self.texts.iter().position(|note| note == text);
        1 + known.unwrap_or_else(|| {
            self.texts.push(text.to_owned());
            self.texts.len() - 1
        })
    }
}

fn cell(figure: &Figure, scale: f64, digits: usize, notes: &mut Notes) -> String {
    let estimate = match figure {
        Figure::Supported(estimate) => estimate,
        Figure::Unsupported { reason } => return format!("– ({})", notes.number(reason)),
    };
    let mut text = format!("{:.digits$}", scale * estimate.value);
    match &estimate.interval {
        Interval::Known { spread, .. } => {
            let _ = write!(text, " ±{:.digits$}", scale * spread.half_width);
        }
        Interval::Unknown { reason } => {
            let _ = write!(text, " ({})", notes.number(reason));
        }
    }
    if let Some(warning) = &estimate.warning {
        let _ = write!(text, " ({})", notes.number(warning));
    }
    text
}

fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}
