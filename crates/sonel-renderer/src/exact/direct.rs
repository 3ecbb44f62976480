//! L R: direct sound by a straight way in general position, along an arc where the speed of sound has a gradient; no bias, no noise.

use glam::DVec3;
use sonel_geometry::{End, Geometry, SurfaceId};
use sonel_map::CoefficientTable;

use crate::partition::Partitions;

/// A way from a source to a receiver.
pub(crate) struct DirectWay {
    /// Its length; where the speed of sound has a gradient its travel time times that of the scene [m].
    pub length: f64,
    /// Unit direction in which it leaves the source.
    pub departing: DVec3,
    /// Unit direction from the receiver back along it.
    pub towards: DVec3,
    /// Fluence per unit emitted energy after spreading [1/m²].
    pub spread: f64,
    /// Partitions passed.
    pub passed: Partitions,
    /// Level surfaces that reflect on the way, none of direct sound.
    pub mirrors: Vec<SurfaceId>,
}

/// The direct way from `source` to `receiver` (both about the scene's centre) in the air of `table`; [`None`] where a surface is in between
/// that nothing passes.
#[must_use]
pub(crate) fn direct_way(
    geometry: &Geometry,
    table: &CoefficientTable,
    source: DVec3,
    receiver: DVec3,
) -> Option<DirectWay> {
    let Some(leg) = table.propagation().leg(source, receiver) else {
        let ends = [
            geometry.in_general_position(source, End::Source),
            geometry.in_general_position(receiver, End::Receiver),
        ];
        let passed = Partitions::on_way(geometry, table, ends)?;
        let offset = receiver - passed.shift() - source;
        let (in_air, departing) = (offset.length(), offset.normalize());
        return Some(DirectWay {
            length: in_air + passed.thickness(),
            departing,
            towards: -departing,
            spread: spread(in_air),
            passed,
            mirrors: Vec::new(),
        });
    };
    let passed = Partitions::along(geometry, table, source.as_vec3(), &leg, receiver.as_vec3())?;
    Some(DirectWay {
        length: leg.length,
        departing: leg.arc.direction(0.0),
        towards: -leg.arc.direction(leg.time),
        spread: leg.spread / (4.0 * core::f64::consts::PI),
        passed,
        mirrors: Vec::new(),
    })
}

/// Fluence per unit emitted energy after spherical spreading over `length` [1/m²].
#[must_use]
pub(crate) fn spread(length: f64) -> f64 {
    1.0 / (4.0 * core::f64::consts::PI * length * length)
}
