//! … D R: from every sonel, whatever became of its packet, a shadow ray to the receiver.
//!
//! F += e · δ · cos θ / (π d²) · e^(−m·length) (docs/physics.md §4): Lambert radiance of the surface times the solid angle of
//! a unit receiver. δ = (1 − α) s is applied here and nowhere else. At a receiver near a surface cos θ / d² has no bound: there
//! the part beyond [`PreparedReceiver::brightest`] is left to visibility rays, so that no single sonel weighs more.

use glam::Vec3;
use sonel_geometry::{Departure, Side};
use sonel_map::{BandValues, Lanes};
use sonel_scene::Leg;

use crate::partition::Partitions;
use crate::receiver::PreparedReceiver;
use crate::stochastic::estimate::{Arriving, Deposit};
use crate::stochastic::selection::Selector;

/// One sonel, ready to be connected.
#[derive(Debug)]
pub(crate) struct DiffuseSonel<'a> {
    /// Position of arrival [m].
    pub position: Vec3,
    /// Normal of the surface on the side of arrival.
    pub normal: Vec3,
    /// Start of a ray from the surface there.
    pub departure: Departure,
    /// Path length so far [m].
    pub length: f64,
    /// e / ē of the selection, at least 1: [`connect`] takes the brighter ones more often.
    pub brightness: f64,
    /// e · δ / π per band, after the air up to here.
    pub radiosity: &'a [Lanes],
}

/// Unit normal of a surface on `side`.
#[inline]
#[must_use]
pub(crate) fn normal_on(side: Side, front: Vec3) -> Vec3 {
    match side {
        Side::Front => front,
        Side::Back => -front,
    }
}

/// Connects one sonel to the receivers: to each with probability p in proportion to its brightness there, and weight 1/p.
#[inline]
pub(crate) fn connect(
    sonel: &DiffuseSonel<'_>,
    receivers: &[PreparedReceiver],
    selectors: &mut [Selector],
    scratch: &mut [Lanes],
    deposit: &mut Deposit<'_, '_>,
) {
    let medium = deposit.medium;
    for ((index, receiver), selector) in receivers.iter().enumerate().zip(selectors) {
        if let Some(leg) = medium.table.propagation().leg(sonel.position.as_dvec3(), receiver.exact) {
            connect_by_arc(sonel, (index, receiver), &leg, scratch, deposit);
            continue;
        }
        let offset = receiver.position - sonel.position;
        let projected = offset.dot(sonel.normal);
        if projected <= 0.0 {
            continue;
        }
        let whole = receiver.solid_angle(projected, offset.length_squared());
        let probability = (sonel.brightness * whole / receiver.thinned_below).min(1.0);
        if !selector.takes(probability) {
            continue;
        }
        if sonel.length + f64::from(offset.length()) * receiver.stretch > medium.bins.reach {
            continue;
        }
        let Some(passed) = medium.partitions(sonel.departure, receiver.position) else { continue };
        // Partitions with thickness shift the way.
        let offset = offset - passed.shift().as_vec3();
        let projected = offset.dot(sonel.normal).max(0.0);
        let distance = f64::from(offset.length_squared()).sqrt();
        let leg = (distance + passed.thickness()) * receiver.stretch;
        let Some(bin) = medium.bins.bin(sonel.length + leg) else { continue };
        let solid_angle = receiver.solid_angle(projected, offset.length_squared());
        let towards = -offset.as_dvec3();
        let solid_angle = solid_angle * receiver.sensitivity.to(towards);
        scratch.set_times(sonel.radiosity, solid_angle / probability);
        passed.attenuate(medium.table, scratch);
        medium.receive(receiver, leg, scratch);
        deposit.add(Arriving { receiver: index, towards, length: leg, bin }, scratch);
    }
}

/// The same along an arc.
#[cold]
fn connect_by_arc(
    sonel: &DiffuseSonel<'_>,
    (index, receiver): (usize, &PreparedReceiver),
    leg: &Leg,
    scratch: &mut [Lanes],
    deposit: &mut Deposit<'_, '_>,
) {
    let medium = deposit.medium;
    let cosine = leg.arc.direction(0.0).dot(sonel.normal.as_dvec3());
    let length = leg.length;
    let Some(bin) = medium.bins.bin(sonel.length + length).filter(|_| cosine > 0.0) else { return };
    let start = sonel.departure.origin;
    let passed = Partitions::along(medium.geometry, medium.table, start, leg, receiver.position);
    let Some(passed) = passed else { return };
    let towards = -leg.arc.direction(leg.time);
    let solid_angle = cosine * leg.spread * receiver.sensitivity.to(towards);
    scratch.set_times(sonel.radiosity, solid_angle);
    passed.attenuate(medium.table, scratch);
    deposit.add(Arriving { receiver: index, towards, length, bin }, scratch);
}
