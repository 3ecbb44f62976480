//! L S^k D R with the diffuse reflection next to the receiver: from the places where rays go on, connections to the source and, in an empty
//! box, its images.
//!
//! Discs would find few of the packets that come straight from the source, and each of them would weigh much. The irradiance of a place
//! by the source is exact, D cos θ / (4π d²) e^(−m d) with D its directivity; of its mirror images one is chosen at random, as for
//! … D S^k R. Sources with a directivity leave their images to the discs.

use sonel_map::{BandValues, Lanes, SegmentHistory};

use super::rays::NearPlace;
use crate::exact::direct::spread;
use crate::exact::mirror::Radiator;
use crate::receiver::PreparedReceiver;
use crate::stochastic::connection::DiffuseSonel;
use crate::stochastic::estimate::{Arriving, Deposit};
use crate::stochastic::mirror_connection::ReceiverImages;

/// A source as places next to receivers see it.
pub(crate) struct NearSource<'a> {
    pub radiator: Radiator<'a>,
    pub images: Option<ReceiverImages>,
}

impl NearSource<'_> {
    /// Whether it finds sonels with `history`, whose mirrors cost `run`, where they come from.
    #[must_use]
    pub(crate) fn finds(&self, history: SegmentHistory, run: u32, limit: u32) -> bool {
        let limit = if self.images.is_some() { limit } else { 0 };
        !history.diffused && history.interfaces == 0 && run <= limit
    }

    /// Adds what `place` sends of it to `receiver`, by number.
    pub(crate) fn connect(
        &self,
        place: &NearPlace<'_>,
        receiver: usize,
        prepared: &PreparedReceiver,
        scratch: &mut [Lanes],
        deposit: &mut Deposit<'_, '_>,
    ) {
        self.connect_directly(place, receiver, prepared, scratch, deposit);
        let Some(images) = &self.images else { return };
        let NearPlace { ray, normal, choice, .. } = *place;
        let mut radiosity = ray.throughput.clone();
        radiosity.scale(spread(1.0));
        deposit.medium.air.attenuate(ray.length.min(deposit.medium.bins.reach), &mut radiosity);
        let sonel = DiffuseSonel {
            position: ray.at.as_vec3(),
            normal,
            departure: ray.departure,
            length: ray.length,
            brightness: 1.0,
            radiosity: &radiosity,
        };
        images.connect(&sonel, (receiver, Some(ray.towards.as_dvec3())), choice, scratch, deposit);
    }

    fn connect_directly(
        &self,
        place: &NearPlace<'_>,
        receiver: usize,
        prepared: &PreparedReceiver,
        scratch: &mut [Lanes],
        deposit: &mut Deposit<'_, '_>,
    ) {
        let medium = deposit.medium;
        let (ray, normal) = (place.ray, place.normal.as_dvec3());
        let offset = self.radiator.position - ray.at.as_vec3().as_dvec3();
        if offset.dot(normal) <= 0.0 {
            return;
        }
        let Some(passed) = medium.partitions(ray.departure, self.radiator.position.as_vec3()) else {
            return;
        };
        let offset = offset - passed.shift();
        let (distance, projected) = (offset.length(), offset.dot(normal).max(0.0));
        let length = (ray.length + distance + passed.thickness()) * prepared.stretch;
        let Some(bin) = medium.bins.bin(length) else { return };
        scratch.fill(Lanes::ONE);
        self.radiator.towards(-offset).weigh(scratch);
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
}
