//! Receivers from options and files.

use std::path::Path;

use anyhow::{Context, bail};
use glam::DVec3;
use sonel::ReceiverPoint;
use sonel_console::input;

/// The receivers in a CSV file, or in a TOML file of `[[receivers]]`.
pub fn read_file(path: &Path) -> anyhow::Result<Vec<ReceiverPoint>> {
    let label = path.display().to_string();
    let text = input::read_to_string(path).with_context(|| format!("cannot read the receivers {label}"))?;
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
        let receivers = sonel_scene::load_receivers(&text, &label)?;
        return Ok(receivers.into_iter().map(|receiver| ReceiverPoint::from(&receiver)).collect());
    }
    read_csv(&text, &label)
}

fn read_csv(text: &str, label: &str) -> anyhow::Result<Vec<ReceiverPoint>> {
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(text.as_bytes());
    let header: Vec<String> = reader.headers()?.iter().map(str::to_lowercase).collect();
    if header != ["name", "x", "y", "z"] {
        bail!("{label}:1: the header is \"{}\"; it must be \"name,x,y,z\"", header.join(","));
    }
    let (mut receivers, mut problems) = (Vec::new(), Vec::new());
    for record in reader.records() {
        match record {
            Ok(record) => {
                let line = record.position().map_or(0, csv::Position::line);
                let numbers: Vec<f64> =
                    record.iter().skip(1).filter_map(|field| field.parse().ok()).collect();
                match (numbers[..].try_into(), record[0].is_empty()) {
                    (Ok(position), false) => {
                        receivers.push(ReceiverPoint::omni(&record[0], DVec3::from_array(position)));
                    }
                    _ => problems.push(format!("{label}:{line}: write a name and three numbers")),
                }
            }
            Err(error) => problems.push(format!("{label}: {error}")),
        }
    }
    if !problems.is_empty() {
        bail!("{}", problems.join("\nerror: "));
    }
    if receivers.is_empty() {
        bail!("{label}: no receivers; write a line with a name and three numbers below the header");
    }
    Ok(receivers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_receivers_are_read() {
        let receivers = read_csv("name, x, y, z\nseat 1, 1, 2.5, -3\n", "seats.csv").unwrap();
        assert_eq!(receivers[0].name, "seat 1");
        assert_eq!(receivers[0].position, DVec3::new(1.0, 2.5, -3.0));
    }

    #[test]
    fn every_bad_line_is_named() {
        let error =
            read_csv("name,x,y,z\na,1,2,x\nb,1,2,3\n,1,2,3\nc,1,2\n", "seats.csv").unwrap_err().to_string();
        assert!(
            error.contains("seats.csv:2:")
                && error.contains("seats.csv:4:")
                && error.contains("seats.csv:5:"),
            "{error}"
        );
        assert!(read_csv("name,x,y,z\n", "seats.csv").unwrap_err().to_string().contains("no receivers"));
        let error = read_csv("x,y,z\n1,2,3\n", "seats.csv").unwrap_err().to_string();
        assert!(error.contains("name,x,y,z"), "{error}");
    }
}
