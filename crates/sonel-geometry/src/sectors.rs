//! The air about an edge, cut into sectors by its faces: an edge diffracts into each that spans more than π.
//!
//! Any number of faces may meet. Sectors of solids are none.

use crate::cells::Cells;
use crate::topology::SharedEdge;
use crate::{Mesh, Side, Surface, SurfaceId};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Angle beyond π from which on a sector of air has an edge [rad]: less is the rounding of a flat wall, and diffracts less than a
/// ten-thousandth of the sound.
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
    /// Angle [rad], above π.
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

/// The sectors of air above π about an edge with `faces`, none of which coincide; `of` gives the surface of a face.
pub(crate) fn diffracting(
    mesh: &Mesh,
    edge: &SharedEdge,
    faces: &[u32],
    surfaces: &[Surface],
    cells: &Cells,
    of: impl Fn(u32) -> SurfaceId,
) -> Vec<AirSector> {
    let along = edge.along(mesh);
    let around = faces.iter().map(|&face| (edge.turn(mesh, faces[0], face), edge.inward(mesh, face), face));
    let mut around: Vec<(f64, DVec3, u32)> = around.collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0).then(of(a.2).cmp(&of(b.2))));
    // The side of a surface that is turned to where angles grow.
    let ahead = |inward: DVec3, face: u32| {
        let is_front = along.cross(inward).dot(surfaces[of(face).0 as usize].normal) > 0.0;
        if is_front { Side::Front } else { Side::Back }
    };
    (0..around.len())
        .filter_map(|at| {
            let (from, inward, face) = around[at];
            let (to, onward, next) = around[(at + 1) % around.len()];
            let angle = if around.len() == 1 { TAU } else { (to - from).rem_euclid(TAU) };
            let faces = [(of(face), ahead(inward, face)), (of(next), ahead(onward, next).opposite())];
            let is_air = cells.is_air(face)[usize::from(!edge.is_ahead(mesh, face))];
            let is_open = is_air && angle > PI + NEARLY_FLAT;
            is_open.then(|| AirSector { faces, inward, normal: along.cross(inward), angle })
        })
        .collect()
}
