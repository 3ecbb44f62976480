//! What the plane of a face leaves of the terms that belong to the image in it.
//!
//! Deep in the image's shadow a face is rigid, on the boundary it is the mirror that it is there, and so it is where it shows the image, whether
//! anything else shades that or not: what comes over the face's own edges does not change at the edges of other objects.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use sonel_diffraction::{Cell, WedgePoint};

use super::super::RoomEdge;
use super::{Family, faded};

/// Fresnel number at which a term of an image that nobody knows to be lit is half there. The smaller it is the more is right deep in shadow;
/// a term that fades within a decimetre still is no step.
pub(crate) const UNKNOWN: f64 = 0.1;

impl Family<'_> {
    /// What the plane of a face of an edge leaves in every cell of a term of the `image` in it between two points about the edge.
    pub(super) fn left(
        &self,
        image: usize,
        index: usize,
        face: usize,
        [from, to]: [WedgePoint; 2],
    ) -> Vec<f64> {
        let world = self.course.world;
        let edge = &world.edges[index];
        let turn = turn(edge, from, to, face);
        let (away, plane) = (excess(from, to, turn), &edge.faces[face]);
        let mirrored: Vec<f64> = self.at.specular(plane).map(f64::sqrt).collect();
        // Nobody knows whether an image of three reflections is lit, so it fades towards where it may be.
        let unknown = world.copy_at_middle(index).may_show_thrice(plane);
        let is_shown = !unknown && (self.images[image].lit.is_some() || self.shows(index, face, image));
        let of = |cell: &Cell| {
            let mirrored = mirrored[cell.band];
            let dark = |half: f64| 1.0 - faded(cell.k, away / half);
            match unknown {
                true if turn > PI => dark(UNKNOWN),
                true => 0.0,
                false if is_shown => mirrored,
                false => mirrored + (1.0 - mirrored) * dark(1.0),
            }
        };
        self.spectrum.cells().iter().map(of).collect()
    }

    /// Whether a face of an edge is where the `image` is seen from the receiver.
    fn shows(&self, index: usize, face: usize, image: usize) -> bool {
        let world = self.course.world;
        let (plane, copy) = (&world.edges[index].faces[face], world.copy_at_middle(index));
        let (from, to) = (self.at.receiver, self.images[image].source.position);
        let [above, below] = [plane.height(from), -plane.height(to)];
        above > 0.0 && below > 0.0 && {
            let foot = from + (to - from) * (above / (above + below));
            copy.behind.image_of(plane).is_felt(self.at.geometry, copy.behind.image(foot), DVec3::ZERO)
        }
    }
}

/// By how much [rad] a wave turns about `edge` that seems to come from the image in `face`: π on the image's boundary.
pub(crate) fn turn(edge: &RoomEdge, source: WedgePoint, receiver: WedgePoint, face: usize) -> f64 {
    let sum = source.angle + receiver.angle;
    if face == 0 { sum } else { 2.0 * edge.wedge.angle() - sum }
}

/// Way over the edge less the straight one of a wave that turns about it by `turn` [rad], in m; grows on both sides of its boundary.
pub(crate) fn excess(source: WedgePoint, receiver: WedgePoint, turn: f64) -> f64 {
    // Beyond a whole turn the image is as far off as it can be.
    let half = libm::cos(0.5 * turn.min(TAU));
    let (sum, offset) = (source.radius + receiver.radius, receiver.along - source.along);
    let detour = libm::hypot(sum, offset);
    let excess = 4.0 * source.radius * receiver.radius * half * half;
    excess / (detour + (detour * detour - excess).max(0.0).sqrt())
}
