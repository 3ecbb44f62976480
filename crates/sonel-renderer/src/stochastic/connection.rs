//! … D R: from every sonel, whatever became of its packet, a shadow ray to the receiver.
//!
//! F += e · δ · cos θ / (π d²) · e^(−m·length) (docs/physics.md §4): Lambert radiance of the surface times the solid angle of
//! a unit receiver. δ = (1 − α) s is applied here and nowhere else. At a receiver near a surface cos θ / d² has no bound: there
//! the part beyond [`PreparedReceiver::brightest`] is left to visibility rays, so that no single sonel weighs more.

use glam::{DVec3, Vec3};
use sonel_geometry::{Departure, Side};
use sonel_map::{BandValues, Lanes};
use sonel_scene::Leg;

use crate::crossings::Crossings;
use crate::deposit::Deposits;
use crate::directions::Axes;
use crate::partition::Partitions;
use crate::receiver::PreparedReceiver;
use crate::rendering::CoarseEchogram;
use crate::stochastic::medium::Medium;

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
    /// e · δ / π per band.
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

/// Arrival of energy at a receiver.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arriving {
    /// Number of the receiver.
    pub receiver: usize,
    /// Direction from the receiver to where it comes from, of any length.
    pub towards: DVec3,
    /// Path length [m].
    pub length: f64,
    /// Time bin of that.
    pub bin: usize,
}

/// Accumulators of an estimator of one class: the echograms of all classes, and the sums of its own.
#[derive(Debug)]
pub(crate) struct ClassDeposits<'a> {
    /// Echograms.
    pub deposits: &'a mut Deposits,
    /// Sum over time, per receiver and band.
    pub sum: &'a mut [Lanes],
    /// Difference to kernels of half the area, by receiver and column.
    pub kernel: &'a mut [CoarseEchogram],
    /// Packets that passed near the balls of receivers.
    pub crossings: &'a mut Crossings,
    /// Axes of the directions, where they are asked for.
    pub axes: &'a Axes,
    /// The coarse bin of every fine bin, by receiver.
    pub coarse_bins: &'a [Vec<u32>],
}

impl ClassDeposits<'_> {
    /// Adds `energy`, spread but not yet attenuated by air, to the echogram of a receiver.
    #[inline]
    pub(crate) fn add(&mut self, arriving: Arriving, energy: &mut [Lanes], medium: &Medium<'_>) {
        let Arriving { receiver, towards, length, bin } = arriving;
        medium.air.attenuate(length, energy);
        let first = receiver * self.axes.columns().fine;
        self.deposits.add(first, bin, energy);
        for (column, weight) in (first + 1..).zip(self.axes.weights(receiver, towards).iter().flatten()) {
            self.deposits.add_times(column, bin, energy, *weight);
        }
        let lanes = energy.len();
        self.sum[receiver * lanes..].add(energy);
    }

    /// The same for energy found by a kernel, `gain` times as much of which half its area would have found.
    #[inline]
    pub(crate) fn add_from_kernel(
        &mut self,
        arriving: Arriving,
        energy: &mut [Lanes],
        gain: f64,
        medium: &Medium<'_>,
    ) {
        self.add(arriving, energy, medium);
        let Arriving { receiver, towards, bin, .. } = arriving;
        let coarse = self.coarse_bins[receiver][bin];
        let columns = self.axes.columns().coarse;
        let weights = self.axes.weights(receiver, towards).into_iter().flatten();
        for (column, weight) in std::iter::once(1.0).chain(weights).take(columns).enumerate() {
            // Once more where the sonel lies in half the area too, less all of it where not.
            let kernel = &mut self.kernel[receiver * columns + column];
            kernel.add_share(coarse as usize, energy, (gain - 1.0) * weight);
        }
    }
}

/// Connects one sonel to all receivers.
#[inline]
pub(crate) fn connect(
    sonel: &DiffuseSonel<'_>,
    receivers: &[PreparedReceiver],
    medium: &Medium<'_>,
    scratch: &mut [Lanes],
    deposits: &mut ClassDeposits<'_>,
) {
    for (index, receiver) in receivers.iter().enumerate() {
        if let Some(leg) = medium.table.propagation().leg(sonel.position.as_dvec3(), receiver.exact) {
            connect_by_arc(sonel, index, receiver, &leg, medium, scratch, deposits);
            continue;
        }
        let offset = receiver.position - sonel.position;
        if offset.dot(sonel.normal) <= 0.0 {
            continue;
        }
        if sonel.length + f64::from(offset.length()) * receiver.stretch > medium.bins.reach {
            continue;
        }
        let Some(passed) = medium.partitions(sonel.departure, receiver.position) else { continue };
        // Partitions with thickness shift the way.
        let offset = offset - passed.shift().as_vec3();
        let projected = offset.dot(sonel.normal).max(0.0);
        let squared = f64::from(offset.length_squared());
        let distance = squared.sqrt();
        let leg = (distance + passed.thickness()) * receiver.stretch;
        let length = sonel.length + leg;
        let Some(bin) = medium.bins.bin(length) else { continue };
        // What is brighter than the receiver's limit is left to its rays.
        let solid_angle = (f64::from(projected) / (distance * squared)).min(receiver.brightest);
        let towards = -offset.as_dvec3();
        let solid_angle = solid_angle * receiver.sensitivity.to(towards);
        scratch.set_times(sonel.radiosity, solid_angle);
        passed.attenuate(medium.table, scratch);
        medium.receive(receiver, leg, scratch);
        deposits.add(Arriving { receiver: index, towards, length, bin }, scratch, medium);
    }
}

/// The same along an arc.
#[cold]
fn connect_by_arc(
    sonel: &DiffuseSonel<'_>,
    index: usize,
    receiver: &PreparedReceiver,
    leg: &Leg,
    medium: &Medium<'_>,
    scratch: &mut [Lanes],
    deposits: &mut ClassDeposits<'_>,
) {
    let cosine = leg.arc.direction(0.0).dot(sonel.normal.as_dvec3());
    let length = sonel.length + leg.length;
    let Some(bin) = medium.bins.bin(length).filter(|_| cosine > 0.0) else { return };
    let start = sonel.departure.origin;
    let passed = Partitions::along(medium.geometry, medium.table, start, leg, receiver.position);
    let Some(passed) = passed else { return };
    let towards = -leg.arc.direction(leg.time);
    let solid_angle = cosine * leg.spread * receiver.sensitivity.to(towards);
    scratch.set_times(sonel.radiosity, solid_angle);
    passed.attenuate(medium.table, scratch);
    deposits.add(Arriving { receiver: index, towards, length, bin }, scratch, medium);
}
