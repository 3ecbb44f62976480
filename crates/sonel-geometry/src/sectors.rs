//! The air about an edge, cut into sectors by its faces: an edge diffracts into each that spans more than π.
//!
//! Any number of faces may meet. A sector behind a face of a closed shell is solid and none.

use crate::topology::SharedEdge;
use crate::{Mesh, Side, Surface, SurfaceId};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// What a sector has to exceed π by [rad] before its edge counts as one: less is the rounding of a flat wall, and turns
/// less than a ten-thousandth of the sound.
const NEARLY_FLAT: f64 = 1e-4;

/// Air about an edge between two of its faces, or all around one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirSector {
    /// The faces it lies between, by surface and by the side that is turned to it; the same surface twice at a free
    /// edge.
    pub faces: [(SurfaceId, Side); 2],
    /// Unit vector from the edge into the first face, at right angles to the edge.
    pub inward: DVec3,
    /// Unit vector from the first face into the sector.
    pub normal: DVec3,
    /// Its angle [rad], above π.
    pub angle: f64,
}

impl AirSector {
    /// Unit vector from the edge into the middle of the sector. What is within a right angle of it is air.
    #[must_use]
    pub fn middle(&self) -> DVec3 {
        let (sine, cosine) = libm::sincos(0.5 * self.angle);
        cosine * self.inward + sine * self.normal
    }

    /// Unit vector from the edge into the second face, at right angles to the edge.
    #[must_use]
    pub fn second_inward(&self) -> DVec3 {
        let (sine, cosine) = libm::sincos(self.angle);
        cosine * self.inward + sine * self.normal
    }

    /// Unit vector from the second face into the sector.
    #[must_use]
    pub fn second_normal(&self) -> DVec3 {
        let (sine, cosine) = libm::sincos(self.angle);
        sine * self.inward - cosine * self.normal
    }
}

/// The sectors above π about an edge whose faces belong to surfaces as `of` tells.
pub(crate) fn diffracting(
    mesh: &Mesh,
    edge: &SharedEdge,
    surfaces: &[Surface],
    of: impl Fn(u32) -> SurfaceId,
) -> Vec<AirSector> {
    let along = edge.along(mesh);
    let origin = edge.inward(mesh, edge.faces[0]);
    let quarter = along.cross(origin);
    let mut around: Vec<(f64, DVec3, SurfaceId, Side)> = edge
        .faces
        .iter()
        .map(|&face| {
            let (inward, surface) = (edge.inward(mesh, face), of(face));
            let turn = libm::atan2(inward.dot(quarter), inward.dot(origin)).rem_euclid(TAU);
            let ahead = along.cross(inward).dot(surfaces[surface.0 as usize].normal) > 0.0;
            (turn, inward, surface, if ahead { Side::Front } else { Side::Back })
        })
        .collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    // Of faces that coincide, as where a solid stands flush against a wall, any may have the solid behind it.
    let is_solid = |turn: f64, ends: bool| {
        around.iter().any(|&(other, _, surface, ahead)| {
            let apart = (other - turn).rem_euclid(TAU);
            let side = if ends { ahead.opposite() } else { ahead };
            apart.min(TAU - apart) < NEARLY_FLAT && surfaces[surface.0 as usize].closed && side == Side::Back
        })
    };
    (0..around.len())
        .filter_map(|at| {
            let (from, inward, surface, side) = around[at];
            let (to, _, next, ahead) = around[(at + 1) % around.len()];
            let angle = if around.len() == 1 { TAU } else { (to - from).rem_euclid(TAU) };
            let faces = [(surface, side), (next, ahead.opposite())];
            let open = angle > PI + NEARLY_FLAT && !is_solid(from, false) && !is_solid(to, true);
            open.then(|| AirSector { faces, inward, normal: along.cross(inward), angle })
        })
        .collect()
}
