//! Receivers from options and files.

use std::path::Path;

use anyhow::{Context, bail};
use csv::StringRecord;
use glam::DVec3;
use sonel::ReceiverPoint;
use sonel_console::input;

/// The receivers in a CSV file, or in a TOML file of `[[receivers]]`.
pub(crate) fn read_file(path: &Path) -> anyhow::Result<Vec<ReceiverPoint>> {
    let label = path.display().to_string();
    let text = input::read_to_string(path).with_context(|| format!("cannot read the receivers {label}"))?;
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
        let receivers = sonel::scenes::load_receivers(&text, &label)?;
        return Ok(receivers.into_iter().map(|receiver| ReceiverPoint::from(&receiver)).collect());
    }
    receivers(&text, &label)
}

fn receivers(text: &str, label: &str) -> anyhow::Result<Vec<ReceiverPoint>> {
    let right = "a name and three numbers";
    let receivers = read_csv(text, label, ["name", "x", "y", "z"], right, |record| {
        let numbers: Vec<f64> = record.iter().skip(1).filter_map(|field| field.parse().ok()).collect();
        let position = numbers[..].try_into().ok()?;
        (!record[0].is_empty()).then(|| ReceiverPoint::omni(&record[0], DVec3::from_array(position)))
    })?;
    if receivers.is_empty() {
        bail!("{label}: no receivers; write a line with {right} below the header");
    }
    Ok(receivers)
}

/// What `read` makes of each row of a CSV file below its `header`. A row that it makes nothing of is not what is `right`.
pub(crate) fn read_csv<T>(
    text: &str,
    label: &str,
    header: [&str; 4],
    right: &str,
    read: impl Fn(&StringRecord) -> Option<T>,
) -> anyhow::Result<Vec<T>> {
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(text.as_bytes());
    let found: Vec<String> = reader.headers()?.iter().map(str::to_lowercase).collect();
    if found != header {
        bail!("{label}:1: the header is \"{}\"; it must be \"{}\"", found.join(","), header.join(","));
    }
    let (mut rows, mut problems) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let row = record.map_err(|error| format!("{label}: {error}")).and_then(|record| {
            let line = record.position().map_or(0, csv::Position::line);
            read(&record).ok_or_else(|| format!("{label}:{line}: write {right}"))
        });
        row.map_or_else(|problem| problems.push(problem), |row| rows.push(row));
    }
    if problems.is_empty() { Ok(rows) } else { bail!("{}", problems.join("\nerror: ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_receivers_are_read() {
        let receivers = receivers("name, x, y, z\nseat 1, 1, 2.5, -3\n", "seats.csv").unwrap();
        assert_eq!(receivers[0].name, "seat 1");
        assert_eq!(receivers[0].position, DVec3::new(1.0, 2.5, -3.0));
    }

    #[test]
    fn every_bad_line_is_named() {
        let error =
            receivers("name,x,y,z\na,1,2,x\nb,1,2,3\n,1,2,3\nc,1,2\n", "seats.csv").unwrap_err().to_string();
        assert!(
            error.contains("seats.csv:2:")
                && error.contains("seats.csv:4:")
                && error.contains("seats.csv:5:"),
            "{error}"
        );
        assert!(receivers("name,x,y,z\n", "seats.csv").unwrap_err().to_string().contains("no receivers"));
        let error = receivers("x,y,z\n1,2,3\n", "seats.csv").unwrap_err().to_string();
        assert!(error.contains("name,x,y,z"), "{error}");
    }
}
