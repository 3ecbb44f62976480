//! The side of a triangle nearest to a straight way: where something leaves a mesh, or is missing from it.
//!
//! Exhaustive, in `f64`: for messages.

use crate::Geometry;
use crate::enclosure::closest_on_segment;
use crate::mesh::sides;
use glam::DVec3;
use std::fmt;

/// A side of a triangle, and the place on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestSide {
    /// The triangle, counted as in [`Geometry::mesh`].
    pub triangle: u32,
    /// Ends of the side, in world coordinates [m].
    pub ends: [DVec3; 2],
    /// The point of the side nearest to the way [m].
    pub place: DVec3,
}

impl Geometry {
    /// The side of a triangle nearest to the way between two world positions [m], which may be one.
    ///
    /// # Panics
    /// Never: a geometry has triangles.
    pub fn nearest_side(&self, way: [DVec3; 2]) -> NearestSide {
        let sides = (0..self.mesh().triangles.len() as u32).flat_map(|triangle| {
            sides(self.mesh().corners(triangle)).map(|ends| (triangle, ends, nearest(ends, way)))
        });
        let (triangle, ends, [place, _]) = sides
            .min_by(|(_, _, a), (_, _, b)| {
                a[0].distance_squared(a[1]).total_cmp(&b[0].distance_squared(b[1]))
            })
            .expect("a geometry has triangles");
        NearestSide { triangle, ends, place }
    }
}

impl fmt::Display for NearestSide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = |point: DVec3| point.to_array().map(|x| format!("{x:.3}")).join(", ");
        let [from, to] = self.ends.map(at);
        let number = self.triangle + 1;
        write!(f, "at ({}) m, at the edge of triangle {number} from ({from}) to ({to}) m", at(self.place))
    }
}

/// The points of two segments that are nearest to one another; the second may be a point.
fn nearest([a, b]: [DVec3; 2], [from, to]: [DVec3; 2]) -> [DVec3; 2] {
    let (side, way) = (b - a, to - from);
    let across = way.cross(side);
    // Where the lines are nearest; any place of parallel ones.
    let share = (a - from).cross(side).dot(across) / across.length_squared().max(f64::MIN_POSITIVE);
    let on_side = closest_on_segment(a, b, from + share.clamp(0.0, 1.0) * way);
    [on_side, closest_on_segment(from, to, on_side)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn segments_are_nearest_where_an_exhaustive_search_finds_them() {
        let at = |i: u32, k: f64| {
            dvec3((f64::from(i) * k).sin(), (f64::from(i) * k * 1.7).cos(), (f64::from(i * i) * k).sin())
        };
        for i in 0..200 {
            let (side, way) =
                ([at(i, 1.1), at(i, 2.3)], [at(i, 3.7), at(i, if i % 5 == 0 { 3.7 } else { 4.9 })]);
            let [p, q] = nearest(side, way);
            let steps = || (0..=100).map(|step| f64::from(step) / 100.0);
            let least = steps()
                .flat_map(|s| steps().map(move |t| side[0].lerp(side[1], s).distance(way[0].lerp(way[1], t))))
                .fold(f64::INFINITY, f64::min);
            assert!(
                p.distance(q) <= least + 1e-12 && p.distance(q) > least - 0.03,
                "{i}: {} {least}",
                p.distance(q)
            );
        }
    }
}
