//! `parameters` of several responses: a column for each, then differences from the first.

use std::io::Write;

use anyhow::bail;
use serde_json::{Value, json};
use sonel::analysis::ReceiverParameters;
use sonel::analysis::comparison::Pairing;
use sonel::analysis::report::{self, Column};

use super::{Read, json_of, seats};
use crate::arguments::{Format, Parameters};

/// Prints all of `responses`.
///
/// # Errors
/// When no source at a receiver is in the first and another one, or `out` cannot be written.
pub(super) fn print(arguments: &Parameters, responses: &[Read], out: &mut dyn Write) -> anyhow::Result<()> {
    let mut columns: Vec<Column> = responses
        .iter()
        .map(|Read { subject, .. }| Column {
            name: subject.name.clone(),
            parameters: subject.parameters.clone(),
            pairing: Pairing::of(
                &responses[0].subject.echograms().provenance,
                &subject.echograms().provenance,
            ),
        })
        .collect();
    let is_measured: Vec<bool> =
        responses.iter().map(|read| read.subject.echograms().is_measured()).collect();
    name_measurements(&mut columns, &is_measured);
    for (column, path) in columns.iter().zip(&arguments.responses).skip(1) {
        let is_shared = column.parameters.iter().any(|found| {
            columns[0]
                .parameters
                .iter()
                .any(|first| (&first.source, &first.name) == (&found.source, &found.name))
        });
        if !is_shared {
            bail!(
                "{} and {} have no source at a receiver in common: both need the same names; a WAV is called as its receiver, of a response with one source",
                arguments.responses[0].display(),
                path.display()
            );
        }
    }
    match arguments.format {
        Format::Table => {
            write!(out, "{}", report::beside_table(&columns, arguments.mean))?;
            for read in responses.iter().filter(|read| !read.shares.is_empty()) {
                write!(out, "\n{}\n{}", read.subject.name, seats::text(&read.shares))?;
            }
        }
        Format::Csv => report::beside_csv(&columns, arguments.mean, out)?,
        Format::Json => {
            let each: Vec<Value> = responses
                .iter()
                .map(|read| {
                    let mut written = json_of(arguments, read);
                    written["name"] = json!(read.subject.name);
                    written
                })
                .collect();
            let differences = report::beside_json(&columns, arguments.mean);
            writeln!(out, "{:#}", json!({ "responses": each, "differences": differences }))?;
        }
    }
    Ok(())
}

/// Gives measurements, whose source has no name, that of what they are compared with: of the only source at the receiver of their name in the first
/// simulation; without simulations all are one pair.
fn name_measurements(columns: &mut [Column], is_measured: &[bool]) {
    let first = is_measured.iter().position(|is_measured| !is_measured);
    let known = columns[first.unwrap_or(0)].parameters.clone();
    let measured = columns.iter_mut().zip(is_measured).filter(|(_, is_measured)| **is_measured);
    for found in measured.flat_map(|(column, _)| &mut column.parameters) {
        let is_same = |other: &&ReceiverParameters| first.is_none() || other.name == found.name;
        if let [one] = known.iter().filter(is_same).collect::<Vec<_>>()[..] {
            (found.source, found.name) = (one.source.clone(), one.name.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel::analysis::comparison::Pairing;
    use sonel::analysis::{ParameterValue, Unsupported};

    fn column(pairs: &[(&str, &str)]) -> Column {
        let none: ParameterValue = Err(Unsupported::NoEnergy);
        let parameters = pairs.iter().map(|(source, receiver)| ReceiverParameters {
            source: (*source).to_owned(),
            source_position: [0.0; 3],
            name: (*receiver).to_owned(),
            position: [0.0; 3],
            speech_transmission_index: none.clone(),
            a_weighted_level_db: none.clone(),
            echo: [none.clone(), none.clone()],
            in_noise: None,
            bands: Vec::new(),
        });
        Column { name: String::new(), parameters: parameters.collect(), pairing: Pairing::Independent }
    }

    /// Names of the pair of the last column, a measurement at "row 1".
    fn named(others: &[Column], is_measured: &[bool]) -> [String; 2] {
        let mut columns = [others, &[column(&[("measured", "row 1")])]].concat();
        name_measurements(&mut columns, &[is_measured, &[true]].concat());
        let found = &columns[others.len()].parameters[0];
        [found.source.clone(), found.name.clone()]
    }

    #[test]
    fn a_measurement_is_of_the_only_source_at_its_receiver() {
        let room = column(&[("stage", "row 1"), ("stage", "row 9")]);
        assert_eq!(named(std::slice::from_ref(&room), &[false]), ["stage", "row 1"]);
        assert_eq!(named(&[column(&[("measured", "before")]), room], &[true, false]), ["stage", "row 1"]);
        let several = column(&[("left", "row 1"), ("right", "row 1")]);
        assert_eq!(named(&[several], &[false]), ["measured", "row 1"]);
        assert_eq!(named(&[column(&[("measured", "before")])], &[true]), ["measured", "before"]);
    }
}
