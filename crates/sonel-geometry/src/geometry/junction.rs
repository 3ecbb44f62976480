//! Junctions: what a path does that meets other surfaces exactly where it meets a surface.
//!
//! One rule for all paths: **a path stays on its side of every surface that it touches.** A reflection at the foot of a
//! partition is blocked if the path would go on behind the partition, and so is a path through the line in which two
//! surfaces meet; where the path arrives and leaves on one side of everything that stands there, it is open.
//!
//! The rule has two forms. A path between given points is asked for its sides ([`Geometry::stays_aside`]). A ray has only
//! its origin: its hit is placed on the origin's side of everything that stands within one lift ([`Geometry::settle`]), so
//! that whoever goes on from there meets it.
//!
//! Holds for surfaces that share vertices and for surfaces that cross or stand on one another without.

use super::Geometry;
use crate::enclosure::closest_on_triangle;
use crate::index::Index;
use crate::probe::Probe;
use crate::rim::keep_inside;
use crate::topology::SharedEdge;
use crate::{Departure, Hit, Mesh, PlaneId, Side};
use glam::{DVec3, Vec3};

/// A hit near a junction is aimed anew at most so often; each time it is on a surface nearer to the origin.
const AIMS: usize = 8;

impl Geometry {
    /// Whether a path from `before` over `at`, a point on a surface, to `after` (local positions [m]) stays on one side of
    /// every other surface within one lift of `at`; surfaces in the planes `own` are not asked.
    #[must_use]
    pub fn stays_aside(&self, before: DVec3, at: DVec3, after: DVec3, own: &[PlaneId]) -> bool {
        let mut aside = true;
        self.visit_standing(at, own, |plane| {
            let plane = self.index.plane(plane);
            let (here, there) = (plane.height_of(before), plane.height_of(after));
            let clearance = f64::from(self.resolution());
            aside &= here * there >= 0.0 || here.abs().min(there.abs()) <= clearance;
        });
        aside
    }

    /// Makes a hit of what a ray from `from` along `direction` met first at `point`, on the ray's side of everything that
    /// stands there.
    pub(super) fn settle(&self, from: Departure, direction: Vec3, point: DVec3, triangle: u32) -> Hit {
        let mut hit = (point, triangle, direction);
        for _ in 0..AIMS {
            let (point, triangle, _) = hit;
            let Some(kept) = self.keep_aside(from.origin, triangle, point) else { break };
            hit.0 = kept;
            let towards = kept.as_vec3() - from.origin;
            if towards == Vec3::ZERO {
                break;
            }
            let plane = self.surface(self.of_triangle[triangle as usize]).plane;
            let aim = Probe::new(from.origin, towards, [from.plane, Some(plane)]);
            let Some(met) = self.index.nearest(&aim).filter(|met| met.distance < 1.0) else { break };
            hit = (aim.at(met.distance), met.triangle, towards);
        }
        let (point, triangle, direction) = hit;
        self.hit(from.origin, direction, point, triangle)
    }

    /// Where a hit near the rim of a triangle or near a surface that stands on it is placed; none where it is near neither.
    fn keep_aside(&self, origin: Vec3, triangle: u32, point: DVec3) -> Option<DVec3> {
        let corners = self.local_corners(triangle);
        let rim = self.rims[triangle as usize];
        if !self.stood_on[triangle as usize] {
            return keep_inside(corners, point, rim);
        }
        let own = self.surface(self.of_triangle[triangle as usize]);
        let lift = f64::from(self.lift());
        let mut kept = point;
        self.visit_standing(point, &[own.plane], |plane| {
            let plane = self.index.plane(plane);
            let outward = if plane.height(origin) < 0.0 { -plane.normal } else { plane.normal };
            let height = plane.height_of(kept) * outward.dot(plane.normal);
            let along = outward.reject_from_normalized(own.normal);
            // One lift off the other surface, within the own one.
            kept += along * ((lift - height).max(0.0) / along.length_squared().max(f64::EPSILON));
        });
        let inside = keep_inside(corners, kept, rim).unwrap_or(kept);
        (inside != point).then_some(inside)
    }

    /// Calls `visit` with the plane of every surface within one lift of a local position [m] that is in none of the planes `own`.
    fn visit_standing(&self, at: DVec3, own: &[PlaneId], mut visit: impl FnMut(PlaneId)) {
        let lift = f64::from(self.lift());
        let (low, high) = ((at - lift).as_vec3(), (at + lift).as_vec3());
        let mut standing = Vec::new();
        self.index.near_box(low, high, |triangle| {
            let plane = self.surface(self.of_triangle[triangle as usize]).plane;
            // Most triangles are in planes far away, which costs less to see than how far the triangle is.
            if !own.contains(&plane)
                && self.index.plane(plane).height_of(at).abs() <= 2.0 * lift
                && closest_on_triangle(self.local_corners(triangle), at).distance(at) <= lift
            {
                standing.push(plane);
            }
        });
        standing.sort_unstable();
        standing.dedup();
        standing.into_iter().for_each(&mut visit);
    }

    fn local_corners(&self, triangle: u32) -> [DVec3; 3] {
        self.mesh.triangles[triangle as usize].corners.map(|c| self.local[c as usize].as_dvec3())
    }

    fn hit(&self, origin: Vec3, direction: Vec3, position: DVec3, triangle: u32) -> Hit {
        let surface = self.of_triangle[triangle as usize];
        let from_front = direction.as_dvec3().dot(self.surface(surface).normal) < 0.0;
        let side = if from_front { Side::Front } else { Side::Back };
        let distance = position.distance(origin.as_dvec3()) as f32;
        Hit { position: position.as_vec3(), distance, triangle, surface, side }
    }
}

/// For each triangle whether another surface's edge touches it off its own rim, as where a partition stands on a floor
/// without sharing its vertices. `margin` [m] is how near is touching.
pub(super) fn stood_on(
    mesh: &Mesh,
    local: &[Vec3],
    edges: &[SharedEdge],
    planes: &[PlaneId],
    index: &Index,
    margin: f64,
) -> Vec<bool> {
    let mut stood_on = vec![false; mesh.triangles.len()];
    for edge in edges {
        let ends = edge.ends.map(|end| local[end as usize].as_dvec3());
        let (low, high) = (ends[0].min(ends[1]) - margin, ends[0].max(ends[1]) + margin);
        index.near_box(low.as_vec3(), high.as_vec3(), |triangle| {
            let plane = planes[triangle as usize];
            let is_other = || {
                !edge.faces.contains(&triangle)
                    && edge.faces.iter().any(|&face| planes[face as usize] != plane)
            };
            if !stood_on[triangle as usize] && is_other() {
                let [a, b, c] =
                    mesh.triangles[triangle as usize].corners.map(|c| local[c as usize].as_dvec3());
                let is_beside = a.max(b).max(c).cmplt(low).any() || a.min(b).min(c).cmpgt(high).any();
                stood_on[triangle as usize] = !is_beside && touches_inside(ends, [a, b, c], margin);
            }
        });
    }
    stood_on
}

/// Whether a segment comes within `margin` [m] of a triangle's plane at a point more than `margin` from its rim.
fn touches_inside([from, to]: [DVec3; 2], [a, b, c]: [DVec3; 3], margin: f64) -> bool {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let height = |point: DVec3| normal.dot(point - a);
    // Each bound is an affine function of the place along the segment that must not be negative.
    let mut range = [0.0, 1.0];
    let mut is_any_left = |start: f64, end: f64| {
        let share = start / (start - end);
        if start < 0.0 && end < 0.0 {
            return false;
        } else if start < 0.0 {
            range[0] = f64::max(range[0], share);
        } else if end < 0.0 {
            range[1] = f64::min(range[1], share);
        }
        range[0] <= range[1]
    };
    is_any_left(margin - height(from), margin - height(to))
        && is_any_left(margin + height(from), margin + height(to))
        && [(a, b), (b, c), (c, a)].into_iter().all(|(p, q)| {
            let inward = normal.cross(q - p).normalize_or_zero();
            let bound = |point: DVec3| inward.dot(point - p) - margin;
            is_any_left(bound(from), bound(to))
        })
}
