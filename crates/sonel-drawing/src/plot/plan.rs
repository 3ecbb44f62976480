//! Plans: a value at each of many receivers, seen along the axis in which they differ least.
//!
//! Receivers that share their coordinates are a grid, each with a cell that reaches halfway to its neighbours, but no further than usual: gaps stay
//! white. Others are dots.

use std::collections::BTreeSet;

use glam::DVec3;
use serde::Serialize;
use sonel_geometry::{Mesh, section};

use super::Axis;

/// Plans with one scale of colours.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plans {
    /// Scale of the colours: label, and range where one is given.
    pub scale: Axis,
    /// Side by side.
    pub each: Vec<Plan>,
}

/// Places with values, and what stands about them, in metres along two axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Above it.
    pub title: String,
    /// Labels of the axes, across and up.
    pub axes: [String; 2],
    /// Receivers.
    pub spots: Vec<Spot>,
    /// Lines, by their ends.
    pub walls: Vec<[[f64; 2]; 2]>,
    /// Sources.
    pub sources: Vec<[f64; 2]>,
    /// Receivers that are not shown, because another one stands at their place of the plan.
    pub hidden: usize,
}

/// A receiver in a plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spot {
    /// Where it is.
    pub at: [f64; 2],
    /// Lower and upper corner of its cell, where it is one of a grid.
    pub cell: Option<[[f64; 2]; 2]>,
    /// In the unit of the scale; none where the response does not support it.
    pub value: Option<f64>,
}

/// A receiver in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanPoint {
    /// [m].
    pub position: [f64; 3],
    /// Value, as [`Spot::value`].
    pub value: Option<f64>,
}

/// Coordinates closer than this are one [m].
const SAME: f64 = 1e-6;
/// A grid of which less than this part is there, as of one in a narrow or slanted room, is none.
const LEAST_SHARE: f64 = 1.0 / 3.0;

/// Where no scene says otherwise, z is up.
const USUAL_UP: usize = 2;

impl Plan {
    /// The plan of `places` and of a source at `source` [m], with the walls of a `mesh` and the one of its axes that is most upright, where they
    /// are known.
    #[must_use]
    pub fn of(title: String, places: &[PlanPoint], source: [f64; 3], room: Option<(&Mesh, DVec3)>) -> Self {
        let positions: Vec<[f64; 3]> = places.iter().map(|place| place.position).collect();
        let plane = Section::of(&positions, room.map_or(USUAL_UP, |(_, up)| up.abs().max_position()));
        let mut plan = plane.plan(title, places);
        plan.sources.push(plane.flat(source));
        if let Some((mesh, _)) = room {
            let lines = section(mesh, plane.normal, plane.offset);
            plan.walls = lines.iter().map(|ends| ends.map(|end| plane.flat(end.to_array()))).collect();
        }
        plan
    }
}

/// The plane of a plan: across `normal`, at the mean of the receivers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Section {
    /// 0, 1, 2 for x, y, z.
    normal: usize,
    /// Along `normal` [m].
    offset: f64,
    /// Axes of the plan, across and up.
    axes: [usize; 2],
}

impl Section {
    /// Through `positions`, across the axis in which they differ least, or across `up` (0, 1, 2) where they differ as little there. A plan is
    /// seen from above, cut at the highest position, so that a sloped floor does not cut it; another section has `up` up and cuts at the mean.
    pub(super) fn of(positions: &[[f64; 3]], up: usize) -> Self {
        let extent = |axis: usize| {
            let values = || positions.iter().map(|position| position[axis]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let order = [up, (up + 1) % 3, (up + 2) % 3];
        let normal = order
            .into_iter()
            .fold(up, |least, axis| if extent(axis) + SAME < extent(least) { axis } else { least });
        let along = || positions.iter().map(|position| position[normal]);
        if normal == up {
            let highest = along().fold(f64::NEG_INFINITY, f64::max);
            return Self { normal, offset: highest, axes: [(up + 1) % 3, (up + 2) % 3] };
        }
        let mean = along().sum::<f64>() / positions.len().max(1) as f64;
        Self { normal, offset: mean, axes: [3 - normal - up, up] }
    }

    /// A position in the plan.
    fn flat(&self, position: [f64; 3]) -> [f64; 2] {
        self.axes.map(|axis| position[axis])
    }

    fn labels(&self) -> [String; 2] {
        self.axes.map(|axis| format!("{} [m]", ["x", "y", "z"][axis]))
    }

    /// The plan of `places` without walls and sources.
    pub(super) fn plan(&self, title: String, places: &[PlanPoint]) -> Plan {
        let mut taken = BTreeSet::new();
        let spot = |place: &PlanPoint| Spot { at: self.flat(place.position), cell: None, value: place.value };
        let is_free =
            |spot: &Spot| taken.insert(spot.at.map(|coordinate| (coordinate / SAME).round() as i64));
        let mut spots: Vec<Spot> = places.iter().map(spot).filter(is_free).collect();
        let hidden = places.len() - spots.len();
        let lines = [0, 1].map(|axis| coordinates(&spots, axis));
        if is_grid(&lines, spots.len()) {
            for spot in &mut spots {
                let [x, y] = [0, 1].map(|axis| around(&lines[axis], spot.at[axis]));
                spot.cell = Some([[x[0], y[0]], [x[1], y[1]]]);
            }
        }
        Plan { title, axes: self.labels(), spots, walls: Vec::new(), sources: Vec::new(), hidden }
    }
}

/// Ascending, each once.
fn coordinates(spots: &[Spot], axis: usize) -> Vec<f64> {
    let mut values: Vec<f64> = spots.iter().map(|spot| spot.at[axis]).collect();
    values.sort_unstable_by(f64::total_cmp);
    values.dedup_by(|a, b| (*a - *b).abs() < SAME);
    values
}

fn is_grid(lines: &[Vec<f64>; 2], count: usize) -> bool {
    let [columns, rows] = lines.each_ref().map(Vec::len);
    let fills = count as f64 >= LEAST_SHARE * (columns * rows) as f64;
    columns > 1 && rows > 1 && columns < count && rows < count && fills
}

/// From halfway to the value before to halfway to the next one, but no further than half the median distance; as far on both sides at an end.
fn around(values: &[f64], value: f64) -> [f64; 2] {
    let index = values.partition_point(|other| *other < value - SAME);
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let median = steps.get(steps.len().saturating_sub(1) / 2).copied().unwrap_or_default();
    let step = |index: usize| {
        values.get(index + 1).zip(values.get(index)).map(|(next, this)| 0.5 * (next - this).min(median))
    };
    let before = index.checked_sub(1).and_then(step);
    let after = step(index);
    let [before, after] = [before.or(after), after.or(before)].map(Option::unwrap_or_default);
    [value - before, value + after]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(positions: &[[f64; 3]]) -> Vec<PlanPoint> {
        positions.iter().map(|&position| PlanPoint { position, value: Some(1.0) }).collect()
    }

    fn grid(height: f64) -> Vec<[f64; 3]> {
        (0..12).map(|i| [f64::from(i % 4), 2.0 * f64::from(i / 4), height]).collect()
    }

    #[test]
    fn a_grid_has_cells_that_touch_and_the_plan_is_seen_from_above() {
        let positions = grid(1.2);
        let section = Section::of(&positions, 2);
        assert_eq!((section.normal, section.labels()), (2, ["x [m]".to_owned(), "y [m]".to_owned()]));
        assert!((section.offset - 1.2).abs() < 1e-12);
        let plan = section.plan(String::new(), &places(&positions));
        assert_eq!((plan.spots.len(), plan.hidden), (12, 0));
        assert_eq!(plan.spots[5].cell, Some([[0.5, 1.0], [1.5, 3.0]]));
        assert_eq!(plan.spots[0].cell, Some([[-0.5, -1.0], [0.5, 1.0]]));
        // In a scene whose y is up, z is to the right of x as seen from above.
        let turned: Vec<[f64; 3]> = positions.iter().map(|[x, y, z]| [*x, *z, *y]).collect();
        assert_eq!(Section::of(&turned, 1).labels(), ["z [m]", "x [m]"]);
    }

    #[test]
    fn a_vertical_grid_is_a_section_with_up_at_the_top() {
        let upright: Vec<[f64; 3]> = grid(3.0).into_iter().map(|[x, y, z]| [z, x, y]).collect();
        let section = Section::of(&upright, 2);
        assert_eq!((section.normal, section.labels()), (0, ["y [m]".to_owned(), "z [m]".to_owned()]));
    }

    #[test]
    fn receivers_above_one_another_are_counted_and_scattered_ones_are_dots() {
        let layers = [grid(1.2), grid(1.7)].concat();
        assert_eq!(Section::of(&layers, 2).plan(String::new(), &places(&layers)).hidden, 12);
        let seats = [[1.0, 2.0, 1.2], [2.5, 3.1, 1.2], [4.0, 1.1, 1.2], [6.0, 2.7, 1.2], [7.0, 0.3, 1.2]];
        let plan = Section::of(&seats, 2).plan(String::new(), &places(&seats));
        assert!(plan.spots.iter().all(|spot| spot.cell.is_none()));
        let single = Section::of(&seats[..1], 2);
        assert_eq!((single.normal, single.plan(String::new(), &places(&seats[..1])).spots.len()), (2, 1));
    }

    /// Stalls and a balcony with an aisle of two metres between them.
    #[test]
    fn cells_do_not_reach_across_gaps() {
        let seats: Vec<[f64; 3]> = [0.0, 1.0, 2.0, 5.0, 6.0]
            .iter()
            .flat_map(|&x| [0.0, 1.0, 2.0].map(|y| [x, y, 0.3 * x]))
            .collect();
        let plan = Section::of(&seats, 2).plan(String::new(), &places(&seats));
        let widths = plan.spots.iter().map(|spot| spot.cell.map(|[low, high]| high[0] - low[0]));
        assert!(widths.into_iter().all(|width| width.is_some_and(|width| (width - 1.0).abs() < 1e-12)));
    }

    #[test]
    fn a_grid_with_gaps_keeps_its_cells() {
        let mut positions = grid(1.2);
        positions.retain(|[x, y, _]| *x > 1.5 || *y < 1.0);
        let plan = Section::of(&positions, 2).plan(String::new(), &places(&positions));
        assert!(plan.spots.iter().all(|spot| spot.cell.is_some()));
    }
}
