//! Planar surfaces as mirrors: images of points.

use glam::DVec3;
use sonel_geometry::{Geometry, PlaneId, Side, SurfaceId};

use super::bodies::{Bodies, WALL};

/// Cosine up to which an angle is a right one: above rounding of normals in double precision.
const RIGHT: f64 = 1e-9;

/// A surface seen from one of its sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mirror {
    pub plane: PlaneId,
    pub surface: SurfaceId,
    /// The body that it belongs to.
    pub body: u32,
    /// Unit normal into the air.
    normal: DVec3,
    /// normal · x of its points, about the scene's centre [m].
    offset: f64,
}

impl Mirror {
    /// A surface seen from one side.
    #[must_use]
    pub(super) fn new(geometry: &Geometry, bodies: &Bodies, (surface, side): (SurfaceId, Side)) -> Self {
        let of = geometry.surface(surface);
        let normal = of.normal * side.sign();
        let offset = side.sign() * (of.offset - of.normal.dot(geometry.center()));
        Self { plane: of.plane, surface, body: bodies.of(surface), normal, offset }
    }

    /// Whether it is a wall.
    #[must_use]
    pub(super) fn is_wall(&self) -> bool {
        self.body == WALL
    }

    /// Unit normal into the air.
    #[must_use]
    pub(super) fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Height of `point` above the plane, positive in the air [m].
    #[must_use]
    pub(super) fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// The mirror image of `point`.
    #[must_use]
    pub(super) fn image(&self, point: DVec3) -> DVec3 {
        point - 2.0 * self.height(point) * self.normal
    }

    /// Whether both are at right angles, but for rounding.
    #[must_use]
    pub(super) fn is_across(&self, other: &Self) -> bool {
        self.normal.dot(other.normal).abs() <= RIGHT
    }

    /// Whether both lie in one plane and face the same side.
    #[must_use]
    pub(super) fn is_coplanar_with(&self, other: &Self) -> bool {
        self.plane == other.plane && self.normal.dot(other.normal) > 0.0
    }
}
