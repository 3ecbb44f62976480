//! L R: direct sound by a shadow ray; no bias, no noise.

use glam::DVec3;
use sonel_geometry::{Departure, Geometry};
use sonel_map::CoefficientTable;

use crate::partition::Partitions;

/// Length [m] and unit direction of the direct path from `source` to `receiver` (both about the scene's centre), and what it passes;
/// [`None`] where a surface is in between that nothing passes.
#[must_use]
pub fn direct_path(
    geometry: &Geometry,
    table: &CoefficientTable,
    source: DVec3,
    receiver: DVec3,
) -> Option<(f64, DVec3, Partitions)> {
    let departure = Departure::free(source.as_vec3());
    let passed = Partitions::between(geometry, table, departure, receiver.as_vec3())?;
    let offset = receiver - source;
    Some((offset.length(), offset.normalize(), passed))
}

/// Fluence per unit emitted energy after spherical spreading over `length` [1/m²].
#[must_use]
pub fn spread(length: f64) -> f64 {
    1.0 / (4.0 * core::f64::consts::PI * length * length)
}
