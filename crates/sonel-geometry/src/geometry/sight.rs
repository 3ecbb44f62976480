//! Straight ways between given points, in `f64` and in general position.
//!
//! Sources, receivers and walls are put on round numbers and planes of symmetry, where a way between them may run through an
//! edge, along a face or through a line in which faces meet. Which faces it crosses is then in doubt, and every answer needs
//! rules for the others. So there are no such ways: both ends are displaced once, by far less than matters and far more than
//! rounding ([`Geometry::in_general_position`]). The faces crossed follow from the signs of triple products alone, equal to
//! the bit for both triangles at a common side.
//!
//! Reference: [EdelsbrunnerMuecke1990] (docs/references.md), whose perturbation is symbolic; ours is a number.

use super::Geometry;
use super::passage::Entry;
use crate::probe::Probe;
use crate::{PlaneId, Side, SurfaceId};
use glam::{DVec3, Vec3};
use smallvec::SmallVec;

/// The two ends of a way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The beginning.
    Source,
    /// The end.
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

/// Most rounds in which a path and the shifts of the partitions on it are made to agree. Chosen, not measured: one round per partition
/// suffices; doubled, paths through more than six partitions are found.
pub const MOST_ROUNDS: usize = 6;

/// Surfaces that a straight path passes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sight {
    /// The surfaces, in order; of partitions with thickness the face that is entered.
    pub surfaces: SmallVec<[SurfaceId; 4]>,
    /// Sum of the [shifts](super::Passage::shift) of partitions with thickness [m]: a way to p runs as one to p less this.
    pub shift: DVec3,
    /// Sum of their thicknesses [m].
    pub thickness: f64,
}

/// A straight piece of a way.
#[derive(Debug, Clone, Copy)]
pub struct Leg {
    /// Beginning, relative to the scene's centre [m].
    pub from: DVec3,
    /// Offset to the end, without the shifts of partitions [m].
    pub way: DVec3,
    /// The plane that was left.
    pub left: Option<PlaneId>,
}

/// A face on a straight way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossed {
    /// Position along the path, 0 … 1.
    pub share: f64,
    /// Local position [m].
    pub place: DVec3,
    /// The surface.
    pub surface: SurfaceId,
    /// The plane of the triangle.
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

    /// Crossing of a triangle by the path `way` from a local position [m].
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

    /// The straight way between two local positions [m] in general position past surfaces that `passes` alone; [`None`] where there is none.
    ///
    /// Every partition with thickness shifts the way, so the direction depends on which are passed: they are assumed, the way is followed, and
    /// both agree in the end, mostly after two rounds.
    pub fn sight(
        &self,
        [from, to]: [DVec3; 2],
        left: Option<PlaneId>,
        passes: impl Fn(SurfaceId) -> bool,
    ) -> Option<Sight> {
        let mut assumed = DVec3::ZERO;
        for _ in 0..MOST_ROUNDS {
            let mut sight = Sight::default();
            let leg = Leg { from, way: to - assumed - from, left };
            let end = self.follow(leg, &passes, |_| false, &mut sight);
            if self.is_same_shift(sight.shift, assumed) {
                return end.is_some().then_some(sight);
            }
            assumed = sight.shift;
        }
        None
    }

    /// Whether two shifts [m] are equal but for rounding.
    #[must_use]
    pub fn is_same_shift(&self, a: DVec3, b: DVec3) -> bool {
        a.distance(b) <= f64::from(self.resolution())
    }

    /// Follows a leg past surfaces that `passes`, to the first face that `ends` it or to its end, and notes in `sight` what is passed. [`None`]
    /// where something is on it that nothing passes.
    pub fn follow(
        &self,
        mut leg: Leg,
        passes: &dyn Fn(SurfaceId) -> bool,
        ends: impl Fn(&Crossed) -> bool,
        sight: &mut Sight,
    ) -> Option<Option<Crossed>> {
        'leg: loop {
            for face in self.faces_between([leg.from, leg.from + leg.way], leg.left) {
                if ends(&face) {
                    return Some(Some(face));
                }
                if !passes(face.surface) {
                    return None;
                }
                let Crossed { share, place, triangle, surface, side, .. } = face;
                let passage = self.passage(&Entry { place, triangle, surface, side })?;
                sight.surfaces.push(surface);
                if passage.emerged.is_some() {
                    sight.shift += passage.shift;
                    sight.thickness += passage.thickness();
                    let (from, left) = (place + passage.shift, passage.departure.plane);
                    leg = Leg { from, way: (1.0 - share) * leg.way, left };
                    continue 'leg;
                }
            }
            return Some(None);
        }
    }

    /// Whether nothing is between two local positions [m] but what is in the plane that was `left`.
    #[must_use]
    pub fn is_clear(&self, ends: [DVec3; 2], left: Option<PlaneId>) -> bool {
        !self.visit_between(ends, left, |_| true)
    }
}
