//! Where two triangles touch, cross or overlap without sharing the corners for it.
//!
//! Two triangles that are not in one plane meet in a part of the line of both planes: each covers an interval of it, and
//! they meet in what both intervals have in common. Corners within the tolerance of the other plane count as lying in it.
//!
//! Reference: [Moeller1997] (docs/references.md).

use crate::mesh::sides;
use crate::stitch::share_along;
use crate::{Crossing, Mesh};
use foldhash::HashSet;
use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;
use smallvec::SmallVec;
use std::time::Duration;

/// Triangles whose neighbours are looked up in one piece of parallel work. Speed alone depends on it.
const CHUNK: usize = 1024;

/// Kind of contact of two triangles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Contact {
    /// In a line, by its ends [m].
    Along([DVec3; 2]),
    /// In a point [m].
    At(DVec3),
    /// In an area of one plane.
    Overlap,
}

/// Two triangles that meet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting {
    pub faces: [u32; 2],
    pub contact: Contact,
    /// Whether each has corners on both sides of the other.
    pub is_crossing: bool,
}

impl Meeting {
    /// The line in which both cross.
    pub(super) fn crossing(&self) -> Option<Crossing> {
        match self.contact {
            Contact::Along(ends) if self.is_crossing => Some(Crossing { ends }),
            _ => None,
        }
    }
}

/// A triangle with its plane.
struct Face {
    ids: [u32; 3],
    corners: [DVec3; 3],
    normal: DVec3,
}

/// All meetings of triangles, or of those `changed` with any, in the order of the mesh.
pub(super) fn find(mesh: &Mesh, changed: Option<&HashSet<u32>>, tolerance: f64) -> Vec<Meeting> {
    let origin = mesh.vertices[0];
    let margin = 2.0 * tolerance;
    let bounds: Vec<Aabb> = (0..mesh.triangles.len() as u32)
        .map(|face| {
            let [a, b, c] = mesh.corners(face).map(|corner| corner - origin);
            let (low, high) = (a.min(b).min(c) - margin, a.max(b).max(c) + margin);
            Aabb { min: Vec3A::from(low.as_vec3()), max: Vec3A::from(high.as_vec3()) }
        })
        .collect();
    let faces: Vec<Face> =
        (0..mesh.triangles.len() as u32).into_par_iter().map(|face| Face::new(mesh, face)).collect();
    let mut tree = build_bvh2(&bounds, BvhBuildParams::fastest_build(), &mut Duration::default());
    // The stack of its traversal, which many long triangles that overlap make deeper than usual.
    tree.max_depth = tree.depth(0) + 1;
    let is_changed = |face: u32| changed.is_none_or(|changed| changed.contains(&face));
    let asked: Vec<u32> = (0..mesh.triangles.len() as u32).filter(|&face| is_changed(face)).collect();
    let found = asked.par_chunks(CHUNK).map(|chunk| {
        let mut found = Vec::new();
        for &first in chunk {
            let from = found.len();
            near(&tree, bounds[first as usize], |second| {
                // Of two that are both asked the lower one asks.
                if second != first && (first < second || !is_changed(second)) {
                    meet(&faces, [first.min(second), first.max(second)], tolerance, &mut found);
                }
            });
            found[from..].sort_by_key(|meeting: &Meeting| meeting.faces);
        }
        found
    });
    found.collect::<Vec<_>>().concat()
}

/// Calls `visit` for every triangle whose bounds meet `bounds`.
fn near(tree: &Bvh2, bounds: Aabb, mut visit: impl FnMut(u32)) {
    tree.aabb_traverse(bounds, |tree, node| {
        let node = &tree.nodes[node as usize];
        let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
        tree.primitive_indices[range].iter().for_each(|&face| visit(face));
        true
    });
}

/// Appends how two triangles meet to `found`, where it is not in the corners and sides that they share.
fn meet(all: &[Face], faces: [u32; 2], tolerance: f64, found: &mut Vec<Meeting>) {
    let [a, b] = faces.map(|face| &all[face as usize]);
    let shared = a.ids.iter().filter(|corner| b.ids.contains(corner)).count();
    if shared == 3 || shared == 2 && a.is_beside(b, tolerance) {
        return;
    }
    let above_a = a.heights(b, tolerance);
    if is_aside(above_a) {
        return;
    }
    let above_b = b.heights(a, tolerance);
    if is_aside(above_b) {
        return;
    }
    let is_in_plane = |heights: [f64; 3]| heights.iter().all(|&height| height == 0.0);
    let mut push = |contact, is_crossing| found.push(Meeting { faces, contact, is_crossing });
    if is_in_plane(above_a) || is_in_plane(above_b) {
        let far = a.farthest_off(b);
        if far > tolerance {
            return;
        }
        let far = far.max(b.farthest_off(a));
        if far < -tolerance {
            push(Contact::Overlap, false);
        } else if far <= tolerance {
            for (one, other) in [(a, b), (b, a)] {
                one.corners_on_sides_of(other, tolerance).for_each(|place| push(Contact::At(place), false));
            }
        }
    } else if shared < 2 {
        let is_shared = |place: DVec3| (0..3).any(|i| a.corners[i] == place && b.ids.contains(&a.ids[i]));
        match common(a.cut(above_b), b.cut(above_a), a.normal.cross(b.normal), tolerance) {
            Some(Contact::At(place)) if is_shared(place) => {}
            Some(contact) => push(contact, is_on_both_sides(above_a) && is_on_both_sides(above_b)),
            None => {}
        }
    }
}

/// Whether all corners are on one side.
fn is_aside(heights: [f64; 3]) -> bool {
    heights.iter().all(|&height| height > 0.0) || heights.iter().all(|&height| height < 0.0)
}

fn is_on_both_sides(heights: [f64; 3]) -> bool {
    heights.iter().any(|&height| height > 0.0) && heights.iter().any(|&height| height < 0.0)
}

impl Face {
    fn new(mesh: &Mesh, face: u32) -> Self {
        let corners = mesh.corners(face);
        let [a, b, c] = corners;
        Self {
            ids: mesh.triangles[face as usize].corners,
            corners,
            normal: (b - a).cross(c - a).normalize_or_zero(),
        }
    }

    /// Heights of another one's corners over its plane [m]; 0 within the tolerance and for common corners.
    fn heights(&self, other: &Self, tolerance: f64) -> [f64; 3] {
        std::array::from_fn(|i| {
            let height = self.normal.dot(other.corners[i] - self.corners[0]);
            if height.abs() <= tolerance || self.ids.contains(&other.ids[i]) { 0.0 } else { height }
        })
    }

    /// Whether another one with a common side is on the other side of it, or leaves the plane.
    fn is_beside(&self, other: &Self, tolerance: f64) -> bool {
        let own = (0..3).find(|&at| !other.ids.contains(&self.ids[at])).unwrap_or(0);
        let far = (0..3).find(|&at| !self.ids.contains(&other.ids[at])).unwrap_or(0);
        let [from, to] = [1, 2].map(|step| self.corners[(own + step) % 3]);
        let (inward, reach) = (self.normal.cross(to - from), other.corners[far] - from);
        self.normal.dot(reach).abs() > tolerance || inward.dot(reach) < -tolerance * from.distance(to)
    }

    /// How far off one of its sides all of another one in its plane is, but for common corners on that side [m]: the most over all sides,
    /// negative where it overlaps.
    fn farthest_off(&self, other: &Self) -> f64 {
        let off = |side: usize| {
            let [from, to] = [side, (side + 1) % 3];
            let outward = (self.corners[to] - self.corners[from]).cross(self.normal);
            let is_end = |at: &usize| other.ids[*at] == self.ids[from] || other.ids[*at] == self.ids[to];
            let heights =
                (0..3).filter(|at| !is_end(at)).map(|at| outward.dot(other.corners[at] - self.corners[from]));
            heights.fold(f64::INFINITY, f64::min) / outward.length()
        };
        (0..3).map(off).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Its corners that lie on a side of another one, and are no corner of it.
    fn corners_on_sides_of<'a>(
        &'a self,
        other: &'a Self,
        tolerance: f64,
    ) -> impl Iterator<Item = DVec3> + 'a {
        let is_on = move |at: &usize| {
            !other.ids.contains(&self.ids[*at])
                && sides(other.corners)
                    .into_iter()
                    .any(|side| share_along(side, self.corners[*at], tolerance).is_some())
        };
        (0..3).filter(is_on).map(|at| self.corners[at])
    }

    /// The points, at most two, in which a plane cuts its rim, given the heights of its corners over that plane.
    fn cut(&self, heights: [f64; 3]) -> SmallVec<[DVec3; 3]> {
        let mut points = SmallVec::new();
        for i in 0..3 {
            let (here, there) = (heights[i], heights[(i + 1) % 3]);
            if here == 0.0 {
                points.push(self.corners[i]);
            } else if here * there < 0.0 {
                points.push(self.between(i, here, there));
            }
        }
        points
    }

    /// The point of a side where the height is zero, the same to the bit for both triangles at the side.
    fn between(&self, side: usize, here: f64, there: f64) -> DVec3 {
        let next = (side + 1) % 3;
        let (from, to) = (self.corners[side], self.corners[next]);
        if self.ids[side] < self.ids[next] {
            from.lerp(to, here / (here - there))
        } else {
            to.lerp(from, there / (there - here))
        }
    }
}

/// The common part of two sets of points on a line along `along`.
fn common(a: SmallVec<[DVec3; 3]>, b: SmallVec<[DVec3; 3]>, along: DVec3, tolerance: f64) -> Option<Contact> {
    let along = along.try_normalize()?;
    let ends = |points: SmallVec<[DVec3; 3]>| {
        let by_place = |p: &&DVec3, q: &&DVec3| p.dot(along).total_cmp(&q.dot(along));
        Some([*points.iter().min_by(by_place)?, *points.iter().max_by(by_place)?])
    };
    let ([a_from, a_to], [b_from, b_to]) = (ends(a)?, ends(b)?);
    let from = if a_from.dot(along) >= b_from.dot(along) { a_from } else { b_from };
    let to = if a_to.dot(along) <= b_to.dot(along) { a_to } else { b_to };
    let length = (to - from).dot(along);
    if length > tolerance {
        Some(Contact::Along([from, to]))
    } else {
        // Where planes are nearly parallel, points that are near the line of both need not be near one another.
        (length >= -tolerance && from.distance(to) <= 2.0 * tolerance).then_some(Contact::At(from))
    }
}
