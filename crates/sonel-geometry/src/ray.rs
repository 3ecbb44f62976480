//! Where rays start and what they meet.

use crate::{PlaneId, Side, SurfaceId};
use glam::Vec3;

/// The start of a ray: a local position, and the plane that was left, if any.
///
/// A straight ray that leaves a plane cannot meet it again, so that plane is not tested. This holds for rays into the
/// half space that the origin was lifted to; only [`Geometry::leave`](crate::Geometry::leave) makes such departures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// Local position [m].
    pub origin: Vec3,
    /// The plane that was left.
    pub plane: Option<PlaneId>,
}

impl Departure {
    /// A start in free space, at a local position [m].
    pub fn free(origin: Vec3) -> Self {
        Self { origin, plane: None }
    }
}

/// The first surface on a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Local position [m], kept a small margin inside the triangle's rim; continue from here by
    /// [`Geometry::leave`](crate::Geometry::leave).
    pub position: Vec3,
    /// Distance from the origin of the ray [m].
    pub distance: f32,
    /// The triangle, an index into the triangles of [`Geometry::mesh`](crate::Geometry::mesh).
    pub triangle: u32,
    /// The surface the triangle belongs to.
    pub surface: SurfaceId,
    /// The side arrived on.
    pub side: Side,
}
