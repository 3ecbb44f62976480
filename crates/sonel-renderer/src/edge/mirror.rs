//! Planes as mirrors: images of points, and mirror paths between two points.

use glam::DVec3;
use sonel_diffraction::Wedge;
use sonel_geometry::{Departure, Geometry, PlaneId, Side, SurfaceId};
use sonel_map::CoefficientTable;

/// Sine of the angle within which directions are perpendicular [1].
pub(crate) const PERPENDICULAR: f64 = 1e-6;

/// A plane seen from the side of its normal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaneMirror {
    pub plane: PlaneId,
    /// One of the surfaces in it.
    pub surface: SurfaceId,
    /// Unit normal towards the air.
    normal: DVec3,
    /// normal · x of its points, about the scene's centre [m].
    offset: f64,
}

impl PlaneMirror {
    /// The plane of `surface`, seen from `side`.
    #[must_use]
    pub fn new(geometry: &Geometry, surface: SurfaceId, side: Side) -> Self {
        let of = geometry.surface(surface);
        let normal = of.normal * side.sign();
        let offset = side.sign() * (of.offset - of.normal.dot(geometry.center()));
        Self { plane: of.plane, surface, normal, offset }
    }

    /// Height of `point` over the plane, positive in the air before it [m].
    #[must_use]
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// Whether `other` is turned to the same side.
    #[must_use]
    pub fn faces_with(&self, other: &Self) -> bool {
        self.normal.dot(other.normal) > 0.0
    }

    /// The mirror image of `point`.
    #[must_use]
    pub fn image(&self, point: DVec3) -> DVec3 {
        point - 2.0 * self.height(point) * self.normal
    }

    /// Image of `other` in this plane.
    #[must_use]
    pub fn image_of(&self, other: &Self) -> Self {
        let normal = other.normal - 2.0 * other.normal.dot(self.normal) * self.normal;
        Self { normal, offset: normal.dot(self.image(other.normal * other.offset)), ..*other }
    }

    /// Image of `wedge`.
    #[must_use]
    pub fn image_of_wedge(&self, wedge: &Wedge) -> Wedge {
        wedge.image(self.normal, self.offset)
    }

    /// Whether it is at a right angle to `other`.
    #[must_use]
    pub fn is_across(&self, other: &Self) -> bool {
        self.normal.dot(other.normal).abs() <= PERPENDICULAR
    }

    /// Whether it is turned to the opposite side of `other`.
    #[must_use]
    pub fn is_turned_from(&self, other: &Self) -> bool {
        (self.normal + other.normal).length() <= PERPENDICULAR
    }

    /// Unit normal towards the air.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.normal
    }
}

/// Whether the path from `from` over `mirrors`, one after the other, to `to` is clear.
#[must_use]
pub(crate) fn reflects(geometry: &Geometry, mirrors: &[PlaneMirror], from: DVec3, to: DVec3) -> bool {
    let (mut at, mut departure) = (from, Departure::free(from.as_vec3()));
    for (done, mirror) in mirrors.iter().enumerate() {
        let image = mirrors[done..].iter().rev().fold(to, |point, mirror| mirror.image(point));
        let (above, below) = (mirror.height(at), -mirror.height(image));
        if above <= 0.0 || below <= 0.0 {
            return false;
        }
        let direction = (image - at).normalize().as_vec3();
        let Some(hit) = geometry.closest_hit(departure, direction) else { return false };
        if geometry.surface(hit.surface).plane != mirror.plane {
            return false;
        }
        at += (image - at) * (above / (above + below));
        departure = geometry.leave(hit.position, hit.surface, hit.side);
    }
    !geometry.is_blocked(departure, to.as_vec3())
}

/// All planes that mirror anything in any band, from every side that faces air, each once.
#[must_use]
pub(crate) fn planes(geometry: &Geometry, table: &CoefficientTable) -> Vec<PlaneMirror> {
    let mut planes: Vec<PlaneMirror> = Vec::new();
    for (index, surface) in geometry.surfaces().iter().enumerate() {
        let specular = &table.material(surface.material).specular.energy;
        if specular.iter().flatten().all(|&factor| factor <= 0.0) {
            continue;
        }
        let sides = if surface.closed { &[Side::Front][..] } else { &[Side::Front, Side::Back] };
        for &side in sides {
            let mirror = PlaneMirror::new(geometry, SurfaceId(index as u32), side);
            let known = |other: &PlaneMirror| other.plane == mirror.plane && other.faces_with(&mirror);
            if !planes.iter().any(known) {
                planes.push(mirror);
            }
        }
    }
    planes
}
