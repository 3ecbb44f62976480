//! L D R with the diffuse reflection next to the receiver: from the places where rays go on, connections to the source.
//!
//! Discs would find few of the packets that come straight from the source, and each of them would weigh much. The irradiance of a place
//! by the source is exact, D cos θ / (4π d²) e^(−m d) with D its directivity.

use sonel_map::{BandValues, Lanes};

use super::rays::NearPlace;
use crate::exact::direct::spread;
use crate::exact::mirror::Radiator;
use crate::receiver::PreparedReceiver;
use crate::stochastic::estimate::{Arriving, Deposit};

/// Adds what `place` sends of `radiator` to `receiver`, by number.
pub(crate) fn connect(
    radiator: &Radiator<'_>,
    place: &NearPlace<'_>,
    receiver: usize,
    prepared: &PreparedReceiver,
    scratch: &mut [Lanes],
    deposit: &mut Deposit<'_, '_>,
) {
    let medium = deposit.medium;
    let (ray, normal) = (place.ray, place.normal.as_dvec3());
    let offset = radiator.position - ray.at.as_vec3().as_dvec3();
    if offset.dot(normal) <= 0.0 {
        return;
    }
    let Some(passed) = medium.partitions(ray.departure, radiator.position.as_vec3()) else {
        return;
    };
    let offset = offset - passed.shift();
    let (distance, projected) = (offset.length(), offset.dot(normal).max(0.0));
    let length = (ray.length + distance + passed.thickness()) * prepared.stretch;
    let Some(bin) = medium.bins.bin(length) else { return };
    scratch.fill(Lanes::ONE);
    radiator.towards(-offset).weigh(scratch);
    for (scratch, &throughput) in scratch.iter_mut().zip(&ray.throughput) {
        *scratch = throughput * (*scratch * spread(distance) * projected / distance);
    }
    if let Some(more) = medium.table.relative_reflection(place.surface, offset) {
        scratch.multiply(&more);
    }
    passed.attenuate(medium.table, scratch);
    medium.receive(prepared, length, scratch);
    deposit.add(Arriving { receiver, towards: ray.towards.as_dvec3(), length, bin }, scratch);
}
