//! Receivers, prepared for the estimators.

use glam::{DVec3, Vec3};
use sonel_geometry::Geometry;

use crate::ball::Balls;

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
    /// The air that stands for the point where segments are counted.
    pub balls: Balls,
    /// Largest cos θ / d² of a sonel that connections take whole [1/m²]; what is beyond is gathered. Infinite where no surface
    /// is near, or where nothing is gathered.
    pub brightest: f64,
}

/// Share of the mean free path that the radius takes at [`REFERENCE_EMISSIONS`].
const RADIUS_PER_FREE_PATH: f64 = 0.12;
/// Radii shrink as N^(−1/6) from here, so that its O(r²) bias vanishes as fast as the noise (docs/physics.md §4).
pub const REFERENCE_EMISSIONS: f64 = 50_000.0;
/// A surface is near within this many radii of a disc: nearer, a single sonel is brighter than a whole disc of them.
const NEAR_PER_DISC: f64 = 2.0;

impl PreparedReceiver {
    /// Prepares `receiver` for a map of `emissions` emissions, in a scene of the given mean free path [m].
    #[must_use]
    pub fn new(
        receiver: &ReceiverPoint,
        geometry: &Geometry,
        mean_free_path: f64,
        emissions: u64,
        gather_radius: Option<f64>,
    ) -> Self {
        let shrink = libm::pow((emissions.max(1)) as f64 / REFERENCE_EMISSIONS, -1.0 / 6.0);
        let wanted = RADIUS_PER_FREE_PATH * mean_free_path * shrink;
        let nearest = geometry.distance_to_nearest_surface(receiver.position);
        let near = gather_radius.map(|radius| NEAR_PER_DISC * radius).filter(|near| nearest < *near);
        let exact = receiver.position - geometry.center();
        Self {
            exact,
            position: geometry.to_local(receiver.position),
            balls: Balls::new(geometry, exact, wanted, nearest, mean_free_path),
            brightest: near.map_or(f64::INFINITY, |near| 1.0 / (near * near)),
        }
    }

    /// Whether a surface is so near that connections share with the gather.
    #[must_use]
    pub fn is_near_surface(&self) -> bool {
        self.brightest.is_finite()
    }

    /// How much of the diffuse reflection at `position`, on a surface with unit `normal`, is gathered rather than connected:
    /// a function of the place. Connections take it at the sonel, the gather at the middle of its disc, so that a disc
    /// smooths the irradiance alone and not the share.
    #[must_use]
    pub fn gathered_share(&self, position: Vec3, normal: Vec3) -> f64 {
        let offset = (self.position - position).as_dvec3();
        let squared = offset.length_squared();
        let solid_angle = offset.dot(normal.as_dvec3()) / (squared * squared.sqrt());
        if solid_angle > self.brightest { 1.0 - self.brightest / solid_angle } else { 0.0 }
    }
}
