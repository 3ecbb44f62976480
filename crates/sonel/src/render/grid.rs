//! Grids of receivers.

use std::collections::{HashMap, HashSet};
use std::fmt::{self, Display, Formatter};
use std::num::NonZeroU32;
use std::str::FromStr;

use crate::study::response::receivers_of;
use glam::DVec3;
use rayon::prelude::*;
use serde_json::{Value, json};
use sonel_geometry::{Geometry, Obstacle};
use sonel_map::ShardRange;
use sonel_renderer::{ReceiverPoint, is_at_source};
use sonel_scene::Scene;

use super::audience::{Audience, MOST_POINTS};
use crate::observer::{Severity, Watch};
use crate::{Error, ParseError, Result};

/// Positions of a grid along the three axes [m].
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    axes: [Axis; 3],
}

impl From<f64> for Axis {
    fn from(position: f64) -> Self {
        Self { low: position, high: position, count: 1 }
    }
}

/// Positions of a grid along one axis [m], both ends included; a single one is in the middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// First position [m].
    pub low: f64,
    /// Last position [m].
    pub high: f64,
    /// Number of parts; 1 or more.
    pub count: u32,
}

impl Axis {
    fn positions(&self) -> Vec<f64> {
        let Self { low, high, count } = *self;
        match count {
            1 => vec![0.5 * (low + high)],
            _ => (0..count).map(|i| low + (high - low) * f64::from(i) / f64::from(count - 1)).collect(),
        }
    }
}

impl Grid {
    /// The grid of `axes` x, y and z.
    ///
    /// # Errors
    /// When it has more than 100 000 points, or none.
    pub fn new(axes: [Axis; 3]) -> Result<Self, ParseError> {
        let points: f64 = axes.iter().map(|axis| f64::from(axis.count)).product();
        if points > MOST_POINTS {
            let text = format!("{points} points are more than {MOST_POINTS}: give fewer along an axis");
            return Err(ParseError(text));
        }
        if axes.iter().any(|axis| axis.count == 0 || !axis.low.is_finite() || !axis.high.is_finite()) {
            return Err(ParseError("a grid needs a point and finite ends on every axis".to_owned()));
        }
        Ok(Self { axes })
    }

    /// All points, x slowest, named by their indices.
    #[must_use]
    pub(crate) fn points(&self) -> Vec<ReceiverPoint> {
        let [xs, ys, zs] = &self.axes.each_ref().map(Axis::positions);
        let point = |i: usize, j: usize, k: usize| {
            ReceiverPoint::omni(&format!("grid {i} {j} {k}"), DVec3::new(xs[i], ys[j], zs[k]))
        };
        let columns = (0..xs.len()).flat_map(|i| (0..ys.len()).map(move |j| (i, j)));
        columns.flat_map(|(i, j)| (0..zs.len()).map(move |k| point(i, j, k))).collect()
    }
}

/// Points of a grid or above an audience, and those left out because no receiver can stand there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GridCounts {
    points: usize,
    on_surfaces: usize,
    in_closed_objects: usize,
    outside: usize,
    at_sources: usize,
    below_faces: usize,
}

/// Three axes, each `lo:hi:n` or one number: `10:60:6,1.2,10:60:6`.
impl FromStr for Grid {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        let axes: Option<Vec<Axis>> = text.split(',').map(parse_axis).collect();
        Self::new(axes.and_then(|axes| axes.try_into().ok()).ok_or_else(|| {
            ParseError(format!(
                "\"{text}\" is not a grid: write three axes, each lo:hi:n or one number: 10:60:6,1.2,10:60:6"
            ))
        })?)
    }
}

/// `lo:hi:n`, both ends included, or one number.
fn parse_axis(text: &str) -> Option<Axis> {
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let number = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite());
    match parts[..] {
        [single] => Some(number(single)?.into()),
        [low, high, count] => {
            let count = count.parse::<NonZeroU32>().ok()?.get();
            Some(Axis { low: number(low)?, high: number(high)?, count })
        }
        _ => None,
    }
}

/// The `given` receivers and free points of `grid` and `audience`, or those of the scene; of these the part of the shard. Points where
/// no receiver can stand are left out, which is said.
pub(super) fn gather(
    given: &[ReceiverPoint],
    grid: Option<&Grid>,
    audience: Option<&Audience>,
    shard: Option<ShardRange>,
    scene: &Scene,
    geometry: &Geometry,
    watch: Watch<'_>,
) -> Result<(Vec<ReceiverPoint>, Option<GridCounts>)> {
    let mut receivers = given.to_vec();
    let mut counts = None;
    if grid.is_some() || audience.is_some() {
        let on_grid = grid.map(Grid::points).unwrap_or_default();
        let (mut free, mut found) = free_points(on_grid, scene, geometry);
        if let Some(audience) = audience {
            let (above, below_faces) = audience.points(scene, geometry)?;
            let (above, of_audience) = free_points(above, scene, geometry);
            found = found.and(GridCounts {
                points: of_audience.points + below_faces,
                below_faces,
                ..of_audience
            });
            free.extend(numbered(above));
        }
        if free.is_empty() && receivers.is_empty() {
            let option = if grid.is_some() { "grid" } else { "audience" };
            return Err(Error::refused(format!("`{option}` has no free point: {found}")));
        }
        if free.len() < found.points {
            watch.say(Severity::Note, &found.to_string())?;
        }
        receivers.extend(free);
        counts = Some(found);
    }
    if receivers.is_empty() {
        receivers = receivers_of(scene);
    }
    if receivers.is_empty() {
        return Err(Error::NoReceivers);
    }
    let mut names = HashSet::new();
    let twice: Vec<&str> =
        receivers.iter().map(|receiver| receiver.name.as_str()).filter(|name| !names.insert(*name)).collect();
    if !twice.is_empty() {
        return Err(Error::refused(format!(
            "receivers share a name: {}; give each its own",
            twice.join(", ")
        )));
    }
    match shard {
        Some(shard) => Ok((part(&receivers, shard)?, counts)),
        None => Ok((receivers, counts)),
    }
}

/// Receivers with a number behind their name, from 1 for each name.
fn numbered(receivers: Vec<ReceiverPoint>) -> impl Iterator<Item = ReceiverPoint> {
    let mut counts: HashMap<String, usize> = HashMap::new();
    receivers.into_iter().map(move |receiver| {
        let count = counts.entry(receiver.name.clone()).or_default();
        *count += 1;
        ReceiverPoint { name: format!("{} {count}", receiver.name), ..receiver }
    })
}

/// The receivers of one shard.
fn part(receivers: &[ReceiverPoint], shard: ShardRange) -> Result<Vec<ReceiverPoint>> {
    let (count, parts) = (receivers.len(), shard.count);
    if count < parts as usize {
        return Err(Error::refused(format!(
            "`shard`: {count} receivers cannot be divided into {parts} parts: give at most {count}"
        )));
    }
    let range = shard.chunks(count as u64);
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
    /// Both together.
    fn and(self, other: Self) -> Self {
        Self {
            points: self.points + other.points,
            on_surfaces: self.on_surfaces + other.on_surfaces,
            in_closed_objects: self.in_closed_objects + other.in_closed_objects,
            outside: self.outside + other.outside,
            at_sources: self.at_sources + other.at_sources,
            below_faces: self.below_faces + other.below_faces,
        }
    }

    /// How many points are left out, by the key and the words of the reason.
    fn reasons(self) -> [(usize, &'static str, &'static str); 5] {
        [
            (self.on_surfaces, "on_surfaces", "on surfaces"),
            (self.in_closed_objects, "in_closed_objects", "inside closed objects"),
            (self.outside, "outside", "outside the room"),
            (self.at_sources, "at_sources", "at a source"),
            (self.below_faces, "below_faces", "below another face"),
        ]
    }

    /// Points that are left out.
    #[must_use]
    pub fn left_out(self) -> usize {
        self.reasons().iter().map(|(count, ..)| count).sum()
    }

    /// Counts as `--json` prints them.
    pub fn json(self) -> Value {
        let left_out = self.reasons().map(|(count, key, _)| (key.to_owned(), json!(count)));
        json!({ "points": self.points, "left_out": Value::from_iter(left_out) })
    }
}

impl Display for GridCounts {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let parts = self.reasons().into_iter().filter(|(count, ..)| *count > 0);
        let parts: Vec<String> = parts.map(|(count, _, place)| format!("{count} {place}")).collect();
        write!(f, "{} of {} points are left out: {}", self.left_out(), self.points, parts.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_read() {
        let grid: Grid = "0:10:3,1.2,-1:1:2".parse().unwrap();
        assert_eq!(grid.points().len(), 6);
        assert_eq!(grid.points()[5].position, DVec3::new(10.0, 1.2, 1.0));
    }

    #[test]
    fn wrong_ones_say_what_is_right() {
        for text in ["1,2", "0:1:0,1,1", "0:1,1,1", "nan,1,1", "0:1:-3,1,1"] {
            assert!(text.parse::<Grid>().unwrap_err().0.contains("lo:hi:n"), "{text}");
        }
        assert!("0:1:1000,0:1:1000,0:1:1000".parse::<Grid>().unwrap_err().0.contains("more than 100000"));
    }
}
