//! Passages through partitions: what enters one face of a wall with thickness leaves its other face at the opposite place.
//!
//! The opposite place is that along the normal, and the direction stays the same, as if the wall had no thickness and the rooms were as far
//! apart as it is thick. So every ray that enters leaves, the map from one face to the other keeps area and angle and is the same both ways:
//! energy is neither lost at floors and side walls within the thickness nor taken from twice.

use super::{Geometry, Side};
use crate::rooms::THICKEST_PARTITION;
use crate::surfaces::PARALLEL;
use crate::{Departure, Hit, SurfaceId};
use glam::DVec3;

/// A way out of a partition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// Start of the path behind it.
    pub departure: Departure,
    /// The face that is left and the side that is come from, of a partition with thickness; none of a sheet.
    pub emerged: Option<Hit>,
    /// Offset from where the partition is entered to where it is left [m], 0 for a sheet.
    pub shift: DVec3,
}

impl Passage {
    /// Thickness of the partition [m].
    #[must_use]
    pub fn thickness(&self) -> f64 {
        self.shift.length()
    }
}

/// A place on a face that is met.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub place: DVec3,
    pub triangle: u32,
    pub surface: SurfaceId,
    pub side: Side,
}

impl Geometry {
    /// Passes the partition met at `hit`; [`None`] where it bounds a room or a solid and no face is opposite: what enters is gone.
    #[must_use]
    pub fn pass(&self, hit: &Hit) -> Option<Passage> {
        let Hit { position, triangle, surface, side, .. } = *hit;
        self.passage(&Entry { place: position.as_dvec3(), triangle, surface, side })
    }

    /// The same for any place.
    ///
    /// What is behind the faces of a room and of objects in it is solid, and faces of two rooms drawn as shells look away from each other
    /// across what is between them. In the open, faces of closed shells that look away from each other, or at each other across a gap
    /// between two rooms, are one partition if they are of one material.
    pub(super) fn passage(&self, entry: &Entry) -> Option<Passage> {
        let Entry { place, triangle, surface, side } = *entry;
        let behind = self.leave(place.as_vec3(), surface, side.opposite());
        let sheet = Passage { departure: behind, emerged: None, shift: DVec3::ZERO };
        let is_solid = side == Side::Front || !self.is_closed_room();
        if !self.is_of_shell(triangle) || !is_solid {
            return Some(sheet);
        }
        let near = self.surface(surface);
        let inward = -side.sign() * near.normal;
        let Some(far) = self.closest_hit(behind, inward.as_vec3()) else {
            return (!self.is_closed_room()).then_some(sheet);
        };
        let other = self.surface(far.surface);
        let height = other.offset - other.normal.dot(self.center() + place);
        let shift = height / other.normal.dot(inward) * inward;
        let is_opposite = self.is_of_shell(far.triangle)
            && near.normal.dot(other.normal).abs() > PARALLEL
            && shift.length() <= THICKEST_PARTITION + f64::from(self.lift());
        let departure = || self.leave(far.position, far.surface, far.side.opposite());
        let through = || Passage { departure: departure(), emerged: Some(far), shift };
        if self.is_closed_room() {
            return (is_opposite && far.side == Side::Back).then(through);
        }
        let is_one = is_opposite && near.normal.dot(other.normal) < 0.0 && near.material == other.material;
        Some(if is_one { through() } else { sheet })
    }

    /// Thickness [m] of the partition of which a surface is a face, the least behind the middles of its triangles; [`None`] for a sheet.
    pub fn partition_thickness(&self, surface: SurfaceId) -> Option<f64> {
        let sides = [Side::Front, Side::Back];
        let triangles = self.surface(surface).triangles.iter();
        let passages = triangles.flat_map(|&triangle| sides.map(|side| (triangle, side)));
        passages
            .filter_map(|(triangle, side)| self.passage_behind(triangle, side))
            .map(|passage| passage.thickness())
            .filter(|&thickness| thickness > 0.0)
            .min_by(f64::total_cmp)
    }

    /// Whether nothing passes a surface of a closed room though something is behind it: too far away, not parallel or not from behind.
    pub fn is_dead_end(&self, surface: SurfaceId) -> bool {
        let is_dead = |&triangle: &u32| {
            let near = self.met_at_middle(triangle, Side::Front).filter(|near| near.surface == surface);
            near.is_some_and(|near| {
                let behind = self.leave(near.position, surface, Side::Back);
                let inward = (-self.surface(surface).normal).as_vec3();
                self.pass(&near).is_none() && self.closest_hit(behind, inward).is_some()
            })
        };
        self.is_closed_room() && self.surface(surface).triangles.iter().all(is_dead)
    }

    /// The passage from the middle of a triangle, met on `side`; none where another surface is met there.
    fn passage_behind(&self, triangle: u32, side: Side) -> Option<Passage> {
        let near = self.met_at_middle(triangle, side)?;
        if near.surface == self.triangle_surface(triangle) { self.pass(&near) } else { None }
    }

    /// Hit at the middle of a triangle from `side`.
    fn met_at_middle(&self, triangle: u32, side: Side) -> Option<Hit> {
        let surface = self.triangle_surface(triangle);
        let [a, b, c] = self.local_corners(triangle);
        let middle = (a + b + c) / 3.0;
        let inward = (-side.sign() * self.surface(surface).normal).as_vec3();
        self.closest_hit(Departure::free(middle - self.lift() * inward), inward)
    }
}
