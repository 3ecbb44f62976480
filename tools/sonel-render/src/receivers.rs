//! Receivers from options, files, grids, or the scene.

use std::collections::HashSet;
use std::fmt::{self, Display, Formatter};
use std::io::Write;
use std::path::Path;

use anyhow::{Context, bail};
use glam::DVec3;
use rayon::prelude::*;
use serde_json::{Value, json};
use sonel_console::input;
use sonel_geometry::{Geometry, Obstacle};
use sonel_map::ShardRange;
use sonel_renderer::{ReceiverPoint, is_at_source};
use sonel_scene::Scene;
use sonel_study::response::receivers_of;

use crate::Arguments;

/// Where to render.
pub struct Gathered {
    /// All receivers.
    pub receivers: Vec<ReceiverPoint>,
    /// Points of the grid, where one was asked for.
    pub grid: Option<GridCounts>,
}

/// Points of a grid, and those left out because no receiver can stand there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GridCounts {
    points: usize,
    on_surfaces: usize,
    in_closed_objects: usize,
    outside: usize,
    at_sources: usize,
}

/// All receivers asked for, or those of the scene. Grid points where no receiver can stand are left out, which is logged.
pub fn gather(
    arguments: &Arguments,
    scene: &Scene,
    geometry: &Geometry,
    log: &mut dyn Write,
) -> anyhow::Result<Gathered> {
    let mut receivers = arguments.receivers.clone();
    if let Some(path) = &arguments.receivers_file {
        receivers.extend(read_file(path)?);
    }
    let mut counts = None;
    if let Some(grid) = &arguments.grid {
        let (free, found) = free_points(grid.points(), scene, geometry);
        if free.is_empty() && receivers.is_empty() {
            bail!("--grid has no free point: {found}");
        }
        if free.len() < found.points {
            writeln!(log, "note: {found}")?;
        }
        receivers.extend(free);
        counts = Some(found);
    }
    if receivers.is_empty() {
        receivers = receivers_of(scene);
    }
    if receivers.is_empty() {
        bail!("no receivers: give --receiver NAME=x,y,z, --receivers FILE or --grid X,Y,Z");
    }
    let mut names = HashSet::new();
    let twice: Vec<&str> =
        receivers.iter().map(|receiver| receiver.name.as_str()).filter(|name| !names.insert(*name)).collect();
    if !twice.is_empty() {
        bail!("receivers share a name: {}; give each its own", twice.join(", "));
    }
    Ok(Gathered { receivers, grid: counts })
}

/// The receivers of one shard.
pub fn part(receivers: Vec<ReceiverPoint>, shard: ShardRange) -> anyhow::Result<Vec<ReceiverPoint>> {
    if receivers.len() < shard.count as usize {
        let (count, parts) = (receivers.len(), shard.count);
        bail!("--shard: {count} receivers cannot be divided into {parts} parts: give at most {count}");
    }
    let range = shard.chunks(receivers.len() as u64);
    Ok(receivers[range.start as usize..range.end as usize].to_vec())
}

/// The points where a receiver can stand, and what became of the others.
fn free_points(
    points: Vec<ReceiverPoint>,
    scene: &Scene,
    geometry: &Geometry,
) -> (Vec<ReceiverPoint>, GridCounts) {
    let sources: Vec<DVec3> = scene.sources.iter().map(|source| source.position).collect();
    let obstacles: Vec<Option<Obstacle>> =
        points.par_iter().map(|point| geometry.obstacle(point.position, &sources)).collect();
    let mut counts = GridCounts { points: points.len(), ..GridCounts::default() };
    let mut free = Vec::new();
    for (point, obstacle) in points.into_iter().zip(obstacles) {
        match obstacle {
            Some(Obstacle::Surface { .. }) => counts.on_surfaces += 1,
            Some(Obstacle::Solid { .. }) => counts.in_closed_objects += 1,
            Some(Obstacle::Hull { .. }) => counts.outside += 1,
            None if is_at_source(point.position, scene, geometry) => counts.at_sources += 1,
            None => free.push(point),
        }
    }
    (free, counts)
}

impl GridCounts {
    /// As `--json` prints it.
    pub fn json(self) -> Value {
        json!({
            "points": self.points,
            "left_out": {
                "on_surfaces": self.on_surfaces,
                "in_closed_objects": self.in_closed_objects,
                "outside": self.outside,
                "at_sources": self.at_sources,
            },
        })
    }
}

impl Display for GridCounts {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let parts = [
            (self.on_surfaces, "on surfaces"),
            (self.in_closed_objects, "inside closed objects"),
            (self.outside, "outside the room"),
            (self.at_sources, "at a source"),
        ];
        let left_out: usize = parts.iter().map(|(count, _)| count).sum();
        let parts: Vec<String> = parts
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, place)| format!("{count} {place}"))
            .collect();
        write!(f, "{left_out} of {} grid points are left out: {}", self.points, parts.join(", "))
    }
}

fn read_file(path: &Path) -> anyhow::Result<Vec<ReceiverPoint>> {
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
