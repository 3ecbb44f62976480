//! A ray with everything precomputed that triangles, boxes and planes ask of it.

use crate::PlaneId;
use glam::{DVec3, Vec3};

/// A ray. Distances along it are multiples of the length of the direction it was made of.
pub(crate) struct Probe {
    /// Local origin [m].
    pub origin: Vec3,
    /// The axes of ray space; the last is the direction's dominant one.
    pub axes: [usize; 3],
    /// Shear that takes the direction to the last axis.
    pub shear: [f32; 2],
    /// Whether the direction is positive along its dominant axis.
    pub upward: bool,
    /// Reciprocal of the direction, finite.
    pub inverse: Vec3,
    /// For each axis, which of a box's two bounds the ray meets first.
    pub near: [usize; 3],
    /// Planes that are passed through.
    pub ignored: [u32; 2],
    exact_origin: DVec3,
    exact_direction: DVec3,
}

/// A plane in local coordinates: normal · x = offset [m].
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalPlane {
    /// Unit normal.
    pub normal: DVec3,
    /// Signed distance from the local origin [m].
    pub offset: f64,
}

/// Direction components are kept this far from zero for boxes, so that 0 · ∞ cannot arise. No box is long enough for
/// such a slope to matter.
const LEAST_SLOPE: f32 = 1e-30;

impl LocalPlane {
    /// Signed height of a local point over the plane [m].
    pub(crate) fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}

impl Probe {
    /// A ray from a local origin; `ignored` planes are passed through.
    #[inline]
    pub(crate) fn new(origin: Vec3, direction: Vec3, ignored: [Option<PlaneId>; 2]) -> Self {
        let size = direction.abs();
        debug_assert!(origin.is_finite() && direction.is_finite() && size.max_element() > 0.0);
        let z = size.max_position();
        // A cyclic permutation, so that orientation survives it.
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let inverse = direction.to_array().map(|d| 1.0 / if d.abs() < LEAST_SLOPE { LEAST_SLOPE } else { d });
        Self {
            origin,
            axes: [x, y, z],
            shear: [direction[x] / direction[z], direction[y] / direction[z]],
            upward: direction[z] > 0.0,
            inverse: inverse.into(),
            near: inverse.map(|i| usize::from(i < 0.0)),
            ignored: ignored.map(|plane| plane.map_or(u32::MAX, |plane| plane.0)),
            exact_origin: origin.as_dvec3(),
            exact_direction: direction.as_dvec3(),
        }
    }

    /// Distance at which the ray's line meets a plane.
    ///
    /// The distance is computed from the plane and not from the triangle: coplanar triangles get equal distances to the bit.
    #[inline(always)]
    pub(crate) fn distance_to(&self, plane: &LocalPlane) -> f64 {
        (plane.offset - plane.normal.dot(self.exact_origin)) / plane.normal.dot(self.exact_direction)
    }

    /// Whether the tip of the direction is beyond a plane as seen from the origin, by more than `clearance` [m].
    #[inline(always)]
    pub(crate) fn tip_is_beyond(&self, plane: &LocalPlane, clearance: f64) -> bool {
        let depth = plane.normal.dot(self.exact_direction);
        let height = plane.offset - plane.normal.dot(self.exact_origin);
        height * depth > 0.0 && depth.abs() - height.abs() > clearance
    }

    /// Height over a plane gained or lost per unit of distance.
    pub(crate) fn steepness(&self, plane: &LocalPlane) -> f64 {
        plane.normal.dot(self.exact_direction).abs()
    }

    /// The point at a distance.
    pub(crate) fn at(&self, distance: f64) -> DVec3 {
        self.exact_origin + distance * self.exact_direction
    }
}
