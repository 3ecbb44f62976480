//! Which receivers: from options, files, grids, or the scene.

use std::collections::HashSet;
use std::io::Write;
use std::path::Path;

use anyhow::{Context, bail};
use glam::DVec3;
use sonel_console::input;
use sonel_geometry::Geometry;
use sonel_renderer::ReceiverPoint;
use sonel_scene::Scene;
use sonel_study::response::receivers_of;

use crate::Arguments;

/// All receivers asked for, or those of the scene. Grid points outside a closed room are left out, which is logged.
pub fn gather(
    arguments: &Arguments,
    scene: &Scene,
    geometry: &Geometry,
    log: &mut dyn Write,
) -> anyhow::Result<Vec<ReceiverPoint>> {
    let mut receivers = arguments.receivers.clone();
    if let Some(path) = &arguments.receivers_file {
        receivers.extend(read_file(path)?);
    }
    if let Some(grid) = &arguments.grid {
        let points = grid.points();
        let count = points.len();
        let inside: Vec<ReceiverPoint> = points
            .into_iter()
            .filter(|p| !geometry.is_closed_room() || geometry.contains(p.position))
            .collect();
        if inside.len() < count {
            writeln!(
                log,
                "note: {} of {count} grid points are outside the room and left out",
                count - inside.len()
            )?;
        }
        receivers.extend(inside);
    }
    if receivers.is_empty() && arguments.grid.is_none() && arguments.receivers_file.is_none() {
        receivers = receivers_of(scene);
    }
    if receivers.is_empty() {
        bail!("there is no receiver: give --receiver NAME=x,y,z, --receivers FILE or --grid X,Y,Z");
    }
    let mut names = HashSet::new();
    let twice: Vec<&str> =
        receivers.iter().map(|receiver| receiver.name.as_str()).filter(|name| !names.insert(*name)).collect();
    if !twice.is_empty() {
        bail!("receivers share a name: {}; give each its own", twice.join(", "));
    }
    Ok(receivers)
}

fn read_file(path: &Path) -> anyhow::Result<Vec<ReceiverPoint>> {
    let label = path.display().to_string();
    let text = input::read_to_string(path).with_context(|| format!("cannot read the receivers {label}"))?;
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
        let receivers = sonel_scene::load_receivers(&text, &label)?;
        return Ok(receivers
            .into_iter()
            .map(|r| ReceiverPoint { name: r.name, position: r.position })
            .collect());
    }
    read_csv(&text, &label)
}

fn read_csv(text: &str, label: &str) -> anyhow::Result<Vec<ReceiverPoint>> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let header: Vec<String> = reader.headers()?.iter().map(str::to_lowercase).collect();
    if header != ["name", "x", "y", "z"] {
        bail!("{label}:1: the header is \"{}\" and should be \"name,x,y,z\"", header.join(","));
    }
    let (mut receivers, mut problems) = (Vec::new(), Vec::new());
    for record in reader.records() {
        match record {
            Ok(record) => {
                let line = record.position().map_or(0, csv::Position::line);
                let numbers: Vec<f64> =
                    record.iter().skip(1).filter_map(|field| field.parse().ok()).collect();
                match (numbers[..].try_into(), record[0].is_empty()) {
                    (Ok(position), false) => receivers.push(ReceiverPoint {
                        name: record[0].to_owned(),
                        position: DVec3::from_array(position),
                    }),
                    _ => problems.push(format!("{label}:{line}: write a name and three numbers")),
                }
            }
            Err(error) => problems.push(format!("{label}: {error}")),
        }
    }
    if problems.is_empty() { Ok(receivers) } else { bail!("{}", problems.join("\nerror: ")) }
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
        let error = read_csv("name,x,y,z\na,1,2,x\nb,1,2,3\n,1,2,3\n", "seats.csv").unwrap_err().to_string();
        assert!(error.contains("seats.csv:2:") && error.contains("seats.csv:4:"), "{error}");
        let error = read_csv("x,y,z\n1,2,3\n", "seats.csv").unwrap_err().to_string();
        assert!(error.contains("name,x,y,z"), "{error}");
    }
}
