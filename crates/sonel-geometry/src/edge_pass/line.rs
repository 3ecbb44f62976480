//! The line of an edge, and the places on ways that touch a cylinder about it.

use super::{Nearby, Way};
use crate::Side;
use glam::DVec3;

/// The line of an edge, about the scene's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeLine {
    /// Its first end [m].
    pub origin: DVec3,
    /// Unit vector towards the other end.
    pub along: DVec3,
    /// Its length [m].
    pub length: f64,
}

impl EdgeLine {
    /// The line between two points about the scene's centre [m].
    #[must_use]
    pub fn new([from, to]: [DVec3; 2]) -> Self {
        Self { origin: from, along: (to - from).normalize_or(DVec3::X), length: from.distance(to) }
    }

    /// The point at `along` from the first end [m].
    #[inline]
    #[must_use]
    pub fn point(&self, along: f64) -> DVec3 {
        self.origin + along * self.along
    }

    /// Where the line from `origin` in a unit `direction` is nearest to that of the edge: how far on both lines [m], and the
    /// square of the distance [m²]. [`None`] where they are parallel.
    #[inline]
    pub(super) fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64, f64)> {
        let offset = origin - self.origin;
        let (slant, height) = (direction.dot(self.along), offset.dot(self.along));
        let across_squared = 1.0 - slant * slant;
        if across_squared < PARALLEL {
            return None;
        }
        let at = (height * slant - offset.dot(direction)) / across_squared;
        let aside = offset.length_squared() - height * height - at * at * across_squared;
        Some((at, height + at * slant, aside.max(0.0)))
    }

    /// Where `way` is within reach of the edge, which is number `edge`, and at its height; [`None`] where nowhere.
    pub(super) fn nearby(&self, edge: u32, way: &Way) -> Option<Nearby> {
        let (at, along, squared) = self.nearest(way.origin, way.direction)?;
        let slant = way.direction.dot(self.along);
        let level = (1.0 - slant * slant).sqrt();
        if squared > way.reach * way.reach {
            return None;
        }
        let within = (way.reach * way.reach - squared).sqrt() / level;
        // Where it is at the height of the ends.
        let ends = [-along, self.length - along].map(|rise| at + rise / slant);
        let (mut from, mut to) = (way.from.max(at - within), way.to.min(at + within));
        if ends.iter().all(|end| end.is_finite()) {
            (from, to) = (from.max(ends[0].min(ends[1])), to.min(ends[0].max(ends[1])));
        } else if along <= 0.0 || along >= self.length {
            return None;
        }
        (from < to).then_some(Nearby { edge, at, distance: squared.sqrt(), level, part: [from, to] })
    }

    /// The closest point of a way that starts at `from` and passes the edge at `distance` from its point at `along`, on `side`: where the
    /// way touches the cylinder of that radius.
    #[must_use]
    pub fn closest(&self, from: DVec3, along: f64, distance: f64, side: Side) -> DVec3 {
        let offset = from - self.origin;
        let radial = offset - offset.dot(self.along) * self.along;
        let radius = radial.length();
        let towards = if radius > 0.0 { radial / radius } else { self.along.any_orthonormal_vector() };
        let cosine = (distance / radius).min(1.0);
        let sine = side.sign() * (1.0 - cosine * cosine).max(0.0).sqrt();
        self.point(along) + distance * (cosine * towards + sine * self.along.cross(towards))
    }

    /// A unit `direction` that passes the edge on `side` with its closest point at `closest point`, turned about the edge by the angle with the
    /// given `tangent`, towards the edge where that is positive. What it has along the edge it keeps.
    #[must_use]
    pub fn turned(&self, closest: DVec3, direction: DVec3, side: Side, tangent: f64) -> DVec3 {
        let offset = closest - self.origin;
        let outward =
            (offset - offset.dot(self.along) * self.along).normalize_or(self.along.any_orthonormal_vector());
        let forward = side.sign() * self.along.cross(outward);
        let slant = direction.dot(self.along);
        let across = (1.0 - slant * slant).max(0.0).sqrt() / (1.0 + tangent * tangent).sqrt();
        slant * self.along + across * (forward - tangent * outward)
    }

    /// Square of the distance of a point from the edge [m²], and where its nearest point is [m].
    #[inline]
    pub(super) fn distance_squared(&self, point: DVec3) -> (f64, f64) {
        let along = (point - self.origin).dot(self.along).clamp(0.0, self.length);
        (point.distance_squared(self.point(along)), along)
    }
}

/// Square of the sine below which a way and an edge are parallel: nothing passes anything.
const PARALLEL: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn feet_are_found_again_from_where_a_way_started() {
        let line = EdgeLine::new([dvec3(1.0, -2.0, 0.5), dvec3(3.0, 4.0, 2.5)]);
        let start = dvec3(-4.0, 1.03, 3.0);
        for step in 0..50 {
            let target = dvec3(5.0, 0.2 * f64::from(step) - 5.0, -2.0 + 0.1 * f64::from(step));
            let direction = (target - start).normalize();
            let (at, along, squared) = line.nearest(start, direction).unwrap();
            if at < 0.0 {
                continue;
            }
            let closest = start + at * direction;
            let outward = closest - line.point(along);
            let side = if line.along.cross(outward).dot(direction) >= 0.0 { Side::Front } else { Side::Back };
            let found = line.closest(start, along, squared.sqrt(), side);
            assert!(found.distance(closest) < 1e-6, "{found} {closest}");
            let straight = line.turned(closest, direction, side, 0.0);
            assert!(straight.distance(direction) < 1e-9);
            let turned = line.turned(closest, direction, side, 0.7);
            assert!((turned.length() - 1.0).abs() < 1e-12 && turned.dot(outward) < 0.0, "towards the edge");
            assert!(
                (turned.dot(line.along) - direction.dot(line.along)).abs() < 1e-12,
                "kept along the edge"
            );
            let across = |d: DVec3| d - d.dot(line.along) * line.along;
            let cosine = across(turned).normalize().dot(across(direction).normalize());
            assert!((cosine - 1.0 / 1.49_f64.sqrt()).abs() < 1e-9);
        }
    }
}
