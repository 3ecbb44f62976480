//! `parameters` of several responses: a column for each, then differences from the first.

use std::io::Write;

use anyhow::bail;
use serde_json::{Value, json};
use sonel_analysis::report::{self, Column};

use super::{Read, json_of, seats};
use crate::arguments::{Format, Parameters};

/// Prints all of `responses`.
///
/// # Errors
/// When no source at a receiver is in the first and another one, or `out` cannot be written.
pub fn print(arguments: &Parameters, responses: &[Read], out: &mut dyn Write) -> anyhow::Result<()> {
    let columns: Vec<Column> = responses
        .iter()
        .map(|read| Column {
            name: read.name.clone(),
            parameters: read.parameters.clone(),
            pairing: sonel_analysis::comparison::Pairing::of(&responses[0].metadata, &read.metadata),
        })
        .collect();
    for (column, path) in columns.iter().zip(&arguments.responses).skip(1) {
        let is_shared = column.parameters.iter().any(|found| {
            columns[0]
                .parameters
                .iter()
                .any(|first| (&first.source, &first.name) == (&found.source, &found.name))
        });
        if !is_shared {
            bail!(
                "{} and {} have no source at a receiver in common: both need the same names",
                arguments.responses[0].display(),
                path.display()
            );
        }
    }
    match arguments.format {
        Format::Table => {
            write!(out, "{}", report::beside_table(&columns, arguments.mean))?;
            for read in responses.iter().filter(|read| !read.shares.is_empty()) {
                write!(out, "\n{}\n{}", read.name, seats::text(&read.shares))?;
            }
        }
        Format::Csv => report::beside_csv(&columns, arguments.mean, out)?,
        Format::Json => {
            let each: Vec<Value> = responses
                .iter()
                .map(|read| {
                    let mut written = json_of(arguments, read);
                    written["name"] = json!(read.name);
                    written
                })
                .collect();
            let differences = report::beside_json(&columns, arguments.mean);
            writeln!(out, "{:#}", json!({ "responses": each, "differences": differences }))?;
        }
    }
    Ok(())
}
