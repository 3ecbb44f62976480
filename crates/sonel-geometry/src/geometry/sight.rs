//! Straight ways between given points, in `f64` and in general position.
//!
//! Sources, receivers and walls are put on round numbers and planes of symmetry, where a way between them may run through an
//! edge, along a face or through a line in which faces meet. Which faces it crosses is then in doubt, and every answer needs
//! rules for the others. So there are no such ways: both ends are displaced once, by far less than matters and far more than
//! rounding ([`Geometry::in_general_position`]). The faces crossed follow from the signs of triple products alone, equal to
//! the bit for both triangles at a common side.
//!
//! Reference: [EdelsbrunnerMuecke1990] (docs/references.md), whose perturbation is symbolic; ours is a number.

use super::{Geometry, THICKEST_PARTITION};
use crate::probe::Probe;
use crate::surfaces::PARALLEL;
use crate::{Hit, PlaneId, Side, SurfaceId};
use glam::{DVec3, Vec3};
use smallvec::SmallVec;

/// The two ends of a way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// Where it begins.
    Source,
    /// Where it ends.
    Receiver,
}

/// Displacement of an end in resolutions: two directions that no plane, line or symmetry of a drawing has. Both point up, so that a
/// way level with the upper edge of a screen passes over it, and to one side of all planes, so that ways are the same in both directions.
const DISPLACEMENTS: [DVec3; 2] = [
    DVec3::new(0.213_774_640_151_283, -0.109_546_718_802_151, 0.438_740_961_207_573),
    DVec3::new(0.317_837_245_195_782, -0.170_820_393_249_937, 0.351_213_771_946_309),
];
/// Half-widths in ulps of the extent, of the region in which the `f32` test of a block leaves a triangle to `f64`: the error of a
/// sheared corner, with the origin's, times the four products in an edge function.
const DOUBTFUL_ULPS: f32 = 512.0;

/// A face on a straight way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossed {
    /// Where on the way, 0 … 1.
    pub share: f64,
    /// Local position [m].
    pub place: DVec3,
    /// The surface.
    pub surface: SurfaceId,
    /// Its plane.
    pub plane: PlaneId,
    /// The side arrived on.
    pub side: Side,
    pub(super) triangle: u32,
}

impl Crossed {
    /// Whether it is met rather than `other` of the same plane: of the two sides of a panel each shows its own face.
    #[must_use]
    pub fn hides(&self, other: &Self) -> bool {
        (self.side == Side::Back, self.triangle) < (other.side == Side::Back, other.triangle)
    }
}

impl Geometry {
    /// A local position [m] displaced by half a resolution, so that no way from it to another one meets an edge or runs along a face.
    #[must_use]
    pub fn in_general_position(&self, place: DVec3, end: End) -> DVec3 {
        place + f64::from(self.resolution()) * DISPLACEMENTS[end as usize]
    }

    /// Calls `visit` for the faces between two local positions [m], in no order, until it returns true; returns whether it did. Faces in the
    /// plane that was `left` are not met again.
    #[inline]
    pub fn visit_between(
        &self,
        [from, to]: [DVec3; 2],
        left: Option<PlaneId>,
        mut visit: impl FnMut(Crossed) -> bool,
    ) -> bool {
        let way = to - from;
        let (origin, direction) = (from.as_vec3(), way.as_vec3());
        if direction == Vec3::ZERO {
            return false;
        }
        let ray = Probe::new(origin, direction, [left, None]);
        let slack = DOUBTFUL_ULPS * f32::EPSILON * self.extent() * self.extent();
        self.index.any_near(&ray, slack, |triangle| self.crossed(from, way, triangle).is_some_and(&mut visit))
    }

    /// Where a way from a local position [m] crosses a triangle.
    fn crossed(&self, from: DVec3, way: DVec3, triangle: u32) -> Option<Crossed> {
        let center = self.scale.center;
        let [a, b, c] = self.mesh.corners(triangle).map(|corner| corner - center - from);
        let (u, v, w) = (way.dot(c.cross(b)), way.dot(a.cross(c)), way.dot(b.cross(a)));
        let is_within = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        let normal = (b - a).cross(c - a);
        let share = normal.dot(a) / normal.dot(way);
        if !is_within || !(0.0..=1.0).contains(&share) {
            return None;
        }
        let surface = self.of_triangle[triangle as usize];
        let plane = self.surface(surface).plane;
        let side = if normal.dot(way) < 0.0 { Side::Front } else { Side::Back };
        Some(Crossed { share, place: from + share * way, surface, plane, side, triangle })
    }

    /// The faces between two local positions [m], in their order; of those that coincide the one that is met.
    #[must_use]
    pub fn faces_between(&self, ends: [DVec3; 2], left: Option<PlaneId>) -> SmallVec<[Crossed; 8]> {
        let mut faces: SmallVec<[Crossed; 8]> = SmallVec::new();
        self.visit_between(ends, left, |crossed| {
            // A straight way crosses a plane once: faces of one plane are met in one place.
            match faces.iter_mut().find(|known| known.plane == crossed.plane) {
                Some(known) if crossed.hides(known) => *known = crossed,
                Some(_) => {}
                None => faces.push(crossed),
            }
            false
        });
        faces.sort_by(|a, b| a.share.total_cmp(&b.share).then(a.triangle.cmp(&b.triangle)));
        faces
    }

    /// Whether `passes` holds for all of some faces in order, asked once for both faces of a partition with thickness: its interior is no air.
    pub fn pass_all(&self, faces: &[Crossed], mut passes: impl FnMut(SurfaceId) -> bool) -> bool {
        let mut rest = faces;
        while let [near, behind @ ..] = rest {
            if !passes(near.surface) {
                return false;
            }
            let is_thick = behind.first().is_some_and(|far| self.are_one_partition(near, far));
            rest = &behind[usize::from(is_thick)..];
        }
        true
    }

    /// Whether two faces met one after the other belong to one partition with thickness.
    ///
    /// What is behind the faces of a room and of objects in it is solid, up to the next face met from behind. In the open, faces of closed
    /// shells that look away from each other, or at each other across a gap between two rooms, are one partition if they are parallel,
    /// of one material and at most [`THICKEST_PARTITION`] apart.
    pub(super) fn are_one_partition(&self, near: &Crossed, far: &Crossed) -> bool {
        let [from, to] = [near, far].map(|face| self.surface(face.surface));
        let are_of_shells = [near, far].iter().all(|face| self.is_of_shell(face.triangle));
        are_of_shells
            && if self.is_closed_room() {
                near.side == Side::Front && far.side == Side::Back
            } else {
                from.normal.dot(to.normal) < -PARALLEL
                    && from.material == to.material
                    && from.normal.dot(far.place - near.place).abs() <= THICKEST_PARTITION
            }
    }

    /// Whether nothing is between two local positions [m] but what is in the plane that was `left`.
    #[must_use]
    pub fn is_clear(&self, ends: [DVec3; 2], left: Option<PlaneId>) -> bool {
        !self.visit_between(ends, left, |_| true)
    }
}

impl From<(&Hit, &Geometry)> for Crossed {
    fn from((hit, geometry): (&Hit, &Geometry)) -> Self {
        let Hit { triangle, surface, side, position, .. } = *hit;
        Self {
            share: 0.0,
            place: position.as_dvec3(),
            surface,
            plane: geometry.surface(surface).plane,
            side,
            triangle,
        }
    }
}
