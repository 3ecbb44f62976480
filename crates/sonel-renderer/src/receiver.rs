//! Receivers, prepared for the estimators.

use glam::{DVec3, Vec3};
use sonel_geometry::Geometry;

/// A place where the echogram is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverPoint {
    /// Its name.
    pub name: String,
    /// Position in the scene's axes [m].
    pub position: DVec3,
}

/// A receiver as the estimators see it.
#[derive(Debug, Clone, Copy)]
pub struct PreparedReceiver {
    /// About the scene's centre [m], exact.
    pub exact: DVec3,
    /// The same in the precision of the geometry.
    pub position: Vec3,
    /// Radius of the sphere that stands for the point where segments must cross it [m].
    pub radius: f64,
}

/// Share of the mean free path that the radius takes at [`REFERENCE_EMISSIONS`].
const RADIUS_PER_FREE_PATH: f64 = 0.12;
/// Radii shrink as N^(−1/6) from here, so that its O(r²) bias vanishes as fast as the noise (docs/physics.md §4).
pub const REFERENCE_EMISSIONS: f64 = 50_000.0;
/// Largest part of the way to the nearest surface: the sphere holds no wall, so every segment through it is seen whole.
const CLEARANCE: f64 = 0.95;

impl PreparedReceiver {
    /// Prepares `receiver` for a map of `emissions` emissions, in a scene of the given mean free path [m].
    #[must_use]
    pub fn new(receiver: &ReceiverPoint, geometry: &Geometry, mean_free_path: f64, emissions: u64) -> Self {
        let shrink = libm::pow((emissions.max(1)) as f64 / REFERENCE_EMISSIONS, -1.0 / 6.0);
        let wanted = RADIUS_PER_FREE_PATH * mean_free_path * shrink;
        let clear = CLEARANCE * geometry.distance_to_nearest_surface(receiver.position);
        Self {
            exact: receiver.position - geometry.center(),
            position: geometry.to_local(receiver.position),
            radius: wanted.min(clear),
        }
    }
}
