//! L R: direct sound by a shadow ray; no bias, no noise.

use glam::DVec3;
use sonel_geometry::{Departure, Geometry};

/// Length [m] and unit direction of the direct path from `source` to `receiver` (both about the scene's centre);
/// [`None`] where a surface is in between.
#[must_use]
pub fn direct_path(geometry: &Geometry, source: DVec3, receiver: DVec3) -> Option<(f64, DVec3)> {
    let blocked = geometry.is_blocked(Departure::free(source.as_vec3()), receiver.as_vec3());
    let offset = receiver - source;
    (!blocked).then(|| (offset.length(), offset.normalize()))
}

/// Fluence per unit emitted energy after spherical spreading over `length` [1/m²].
#[must_use]
pub fn spread(length: f64) -> f64 {
    1.0 / (4.0 * core::f64::consts::PI * length * length)
}
