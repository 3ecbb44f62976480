//! The lengths below which nothing can be told apart, all derived from the size of the scene.
//!
//! Local coordinates are `f32` within ± `extent`, where neighbouring numbers are at most 2⁻²³ × extent apart (one
//! *ulp*). Rounding a point, shearing a vertex into ray space and rounding a plane's corners each move things by about
//! one ulp, so a sum of three or four of them is [`Scale::resolution`].

use glam::{DVec3, Vec3};

/// The scene's centre and size, and the tolerances that follow.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    /// World position of the local origin [m].
    pub center: DVec3,
    /// Largest local coordinate of any vertex [m].
    pub extent: f32,
}

/// Units in the last place that the errors of one hit add up to: position, shear, corners, plane.
const ULPS_PER_RESOLUTION: f32 = 4.0;
/// The lift exceeds the resolution so far that a lifted origin is on its side beyond doubt.
const RESOLUTIONS_PER_LIFT: f32 = 4.0;

impl Scale {
    /// The scale of a scene within the given bounds [m].
    pub(crate) fn of_bounds(low: DVec3, high: DVec3) -> Self {
        let center = 0.5 * (low + high);
        let extent = (high - center).max(center - low).max_element();
        Self { center, extent: extent as f32 * (1.0 + f32::EPSILON) }
    }

    /// Distance [m] below which two positions are the same.
    pub(crate) fn resolution(&self) -> f32 {
        ULPS_PER_RESOLUTION * f32::EPSILON * self.extent
    }

    /// Distance [m] from a surface at which rays leave it.
    pub(crate) fn lift(&self) -> f32 {
        RESOLUTIONS_PER_LIFT * self.resolution()
    }

    /// World to local coordinates.
    pub(crate) fn to_local(self, world: DVec3) -> Vec3 {
        (world - self.center).as_vec3()
    }

    /// Local to world coordinates.
    pub(crate) fn to_world(self, local: Vec3) -> DVec3 {
        local.as_dvec3() + self.center
    }
}
