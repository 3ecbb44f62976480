//! Receivers, prepared for the estimators.

use core::f64::consts::{FRAC_1_SQRT_2, PI};

use glam::{DVec3, Vec3};
use sonel_geometry::{Departure, Geometry};
use sonel_sampling::{ScrambledSobol, warp};

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
    /// What walls leave of the sphere; none where it holds no wall.
    pub cut: Option<CutSphere>,
    /// Largest cos θ / d² of a sonel that connections take whole [1/m²]; what is beyond is left to rays. Infinite where no surface
    /// is near, or where no rays are cast.
    pub brightest: f64,
}

/// Share of the mean free path that the radius takes at [`REFERENCE_EMISSIONS`].
const RADIUS_PER_FREE_PATH: f64 = 0.12;
/// Radii shrink as N^(−1/6) from here, so that its O(r²) bias vanishes as fast as the noise (docs/physics.md §4).
pub const REFERENCE_EMISSIONS: f64 = 50_000.0;
/// A surface is near within this many radii of a disc: nearer, few sonels bring much, and rays are calmer than connections.
const NEAR_PER_DISC: f64 = 4.0;
/// A sphere that takes no more of the way to the nearest surface than this holds no wall.
const CLEARANCE: f64 = 0.95;
/// Rays that measure what walls leave of a sphere.
const MEASURING_RAYS: u32 = 8192;

/// The part of a sphere that is seen from its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutSphere {
    /// Its volume [m³].
    pub volume: f64,
    /// Volume of the same part of the sphere of 1/√2 the radius [m³].
    pub inner_volume: f64,
}

impl CutSphere {
    /// What walls leave of the sphere of `radius` about `centre`, in local coordinates [m].
    fn new(geometry: &Geometry, centre: Vec3, radius: f64) -> Self {
        let directions = ScrambledSobol::numbered(0, 0, 0);
        let (mut outer, mut inner) = (0.0, 0.0);
        for ray in 0..MEASURING_RAYS {
            let direction = warp::uniform_sphere(directions.point(ray));
            let hit = geometry.closest_hit(Departure::free(centre), direction);
            let seen = hit.map_or(f64::INFINITY, |hit| f64::from(hit.distance));
            outer += libm::pow(seen.min(radius), 3.0);
            inner += libm::pow(seen.min(radius * FRAC_1_SQRT_2), 3.0);
        }
        let share = 4.0 * PI / 3.0 / f64::from(MEASURING_RAYS);
        Self { volume: share * outer, inner_volume: share * inner }
    }
}

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
        let clear = CLEARANCE * nearest;
        let position = geometry.to_local(receiver.position);
        // The scale of an open scene says nothing of how far the field about a receiver is alike.
        let is_cut = wanted > clear && geometry.volume().is_some();
        let near = gather_radius.map(|radius| NEAR_PER_DISC * radius).filter(|near| nearest < *near);
        Self {
            exact: receiver.position - geometry.center(),
            position,
            radius: if is_cut { wanted } else { wanted.min(clear) },
            cut: is_cut.then(|| CutSphere::new(geometry, position, wanted)),
            brightest: near.map_or(f64::INFINITY, |near| 1.0 / (near * near)),
        }
    }

    /// A point that only images are made of, about the scene's centre [m].
    #[must_use]
    pub fn point(exact: DVec3) -> Self {
        Self { exact, position: exact.as_vec3(), radius: 0.0, cut: None, brightest: f64::INFINITY }
    }

    /// Whether a surface is so near that connections share with the gather.
    #[must_use]
    pub fn is_near_surface(&self) -> bool {
        self.brightest.is_finite()
    }

    /// How much of what a place under `solid_angle` (cos θ / d², d by way of mirrors if need be) [1/m²] reflects diffusely is left to rays:
    /// connections bring the rest.
    #[must_use]
    pub fn followed_share(&self, solid_angle: f64) -> f64 {
        if solid_angle > self.brightest { 1.0 - self.brightest / solid_angle } else { 0.0 }
    }

    /// Whether `position` is so near that rays go on from there instead of gathering.
    #[must_use]
    pub fn is_near(&self, position: Vec3) -> bool {
        self.is_near_along(f64::from(self.position.distance(position)))
    }

    /// Whether a place at the end of a way of `length` [m] can be near.
    #[must_use]
    pub fn is_near_along(&self, length: f64) -> bool {
        length * length * self.brightest < 1.0
    }
}
