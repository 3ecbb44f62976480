//! Boxes along the axes, to tell quickly what is far from one another.

use glam::DVec3;
use sonel_geometry::{Geometry, Surface};

use super::mirror::PlaneMirror;

/// How far off a plane, in resolutions, feet in it may lie.
const ROUNDING: f64 = 8.0;

/// A box along the axes, about the scene's centre [m].
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    low: DVec3,
    high: DVec3,
}

impl Extent {
    /// Of `points`.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        let nothing = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        let with = |extent: Self, point| Self { low: extent.low.min(point), high: extent.high.max(point) };
        points.into_iter().fold(nothing, with)
    }

    /// Of all surfaces in the plane of a mirror.
    #[must_use]
    pub fn of_plane(geometry: &Geometry, mirror: &PlaneMirror) -> Self {
        let mesh = geometry.mesh();
        let own = |surface: &&Surface| surface.plane == mirror.plane;
        let triangles = geometry.surfaces().iter().filter(own).flat_map(|surface| &surface.triangles);
        let corners = triangles.flat_map(|&triangle| mesh.triangles[triangle as usize].corners);
        let Self { low, high } =
            Self::of(corners.map(|corner| mesh.vertices[corner as usize] - geometry.center()));
        let within = ROUNDING * f64::from(geometry.resolution());
        Self { low: low - within, high: high + within }
    }

    /// Of all places over which the way between two points is no more than `far` [m] longer than the straight one: an ellipsoid.
    #[must_use]
    pub fn of_ways([from, to]: [DVec3; 2], far: f64) -> Self {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let long = half.length() + 0.5 * far;
        let across = long * long - half.length_squared();
        let reach = (half * half + across).map(f64::sqrt);
        Self { low: middle - reach, high: middle + reach }
    }

    /// Whether it and `other` have a place in common.
    #[must_use]
    pub fn touches(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}
