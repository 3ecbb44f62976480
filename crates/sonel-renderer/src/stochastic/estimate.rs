//! Estimate of one batch at some receivers: where all stochastic estimators bring energy.

use glam::DVec3;
use sonel_map::{BandValues, Event, Lanes, Segment, lanes_of};

use crate::crossings::Crossings;
use crate::deposit::{Deposits, TimeBins};
use crate::directions::{Axes, Columns};
use crate::path_class::PathClass;
use crate::receiver::{PreparedReceiver, axes};
use crate::rendering::{CoarseEchogram, Rendering};
use crate::stochastic::medium::Medium;

/// Receivers whose echograms are estimated together.
pub(crate) struct ReceiverTile<'a> {
    /// Index of the first.
    pub first: usize,
    /// The receivers.
    pub receivers: &'a [PreparedReceiver],
    /// Time borders of their batches [s].
    pub borders: &'a [Vec<f64>],
    /// Lengths of the straight ways from the source [m].
    pub direct_lengths: Vec<f64>,
    /// The coarse bin of every fine bin, by receiver.
    pub coarse_bins: Vec<Vec<u32>>,
}

/// One batch's estimate: all its echograms, and the sums of its classes per receiver.
pub(crate) struct BatchEstimate<'t> {
    tile: &'t ReceiverTile<'t>,
    deposits: Deposits,
    sums: [Vec<Lanes>; PathClass::ALL.len()],
    /// Packets that passed near the balls of the receivers.
    pub crossings: Crossings,
    /// E′ − E by receiver and column, see [`crate::stochastic::kernel`].
    kernel: Vec<CoarseEchogram>,
    axes: Axes,
    /// Energy under way at [`TimeBins::marks`](crate::deposit::TimeBins::marks).
    under_way: [Vec<Lanes>; 2],
}

impl<'t> BatchEstimate<'t> {
    pub(crate) fn new(tile: &'t ReceiverTile<'t>, bins: usize, bands: usize) -> Self {
        let axes = axes(tile.receivers);
        let Columns { fine, coarse } = axes.columns();
        Self {
            tile,
            deposits: Deposits::new(tile.receivers.len() * fine, bins, bands),
            kernel: CoarseEchogram::of_receivers(tile.borders, coarse, bands),
            axes,
            sums: PathClass::ALL.map(|_| vec![Lanes::ZERO; tile.receivers.len() * lanes_of(bands)]),
            crossings: Crossings::new(tile.receivers.len(), bands),
            under_way: [(); 2].map(|()| vec![Lanes::ZERO; lanes_of(bands)]),
        }
    }

    /// Forgets the batch before. Memory is taken over from batch to batch: fresh pages would cost a tenth of the time.
    pub(crate) fn clear(&mut self) {
        self.deposits.clear();
        self.sums.iter_mut().chain(&mut self.under_way).for_each(|sum| sum.fill(Lanes::ZERO));
        self.crossings.clear();
        self.kernel.iter_mut().for_each(CoarseEchogram::clear);
    }

    /// Counts what `segment` carries at [`TimeBins::marks`](crate::deposit::TimeBins::marks). What escapes brings nothing any more.
    pub(crate) fn record_segment(
        &mut self,
        segment: &Segment<'_>,
        medium: &Medium<'_>,
        scratch: &mut [Lanes],
    ) {
        let escapes = matches!(segment.event, Event::Escaped | Event::Lost | Event::Left);
        for (sum, mark) in self.under_way.iter_mut().zip(medium.bins.marks()) {
            if escapes || mark < segment.start_length || mark >= segment.end_length {
                continue;
            }
            scratch.copy_from_slice(segment.energy);
            medium.airs.fade(segment.air, mark - segment.start_length, scratch);
            medium.air.attenuate(mark, scratch);
            sum.add(scratch);
        }
    }

    /// Adds the estimate of `batch` of `weight` to `rendering`, its echograms to `total`.
    pub(crate) fn add_to(
        &self,
        rendering: &mut Rendering,
        total: &mut Deposits,
        (batch, weight): (usize, f64),
        bins: &TimeBins,
    ) {
        let tile = self.tile;
        let receivers = tile.receivers.len();
        for (class, sums) in PathClass::ALL.into_iter().zip(&self.sums) {
            for (receiver, sum) in (tile.first..).zip(sums.chunks_exact(sums.len() / receivers)) {
                rendering.record(class, receiver, weight, sum);
            }
        }
        rendering.crossings.add(tile.first, &self.crossings, weight);
        if tile.first == 0 {
            rendering.add_energy_in_flight(weight, &self.under_way);
        }
        let columns = self.axes.columns();
        total.add_receivers(tile.first * columns.fine, &self.deposits, weight);
        for (local, column) in (0..receivers).flat_map(|local| (0..columns.coarse).map(move |c| (local, c))) {
            let index = (tile.first + local) * columns.coarse + column;
            rendering.kernel_differences[batch][index].add(&self.kernel[local * columns.coarse + column]);
            let (borders, first_arrival) = (&tile.borders[local], bins.time(tile.direct_lengths[local]));
            let fine = local * columns.fine + column;
            let coarse = &mut rendering.batches[batch][index];
            coarse.add_fine(borders, &self.deposits, fine, bins, first_arrival);
        }
    }

    /// Where the estimator of `class` brings energy through `medium`.
    pub(crate) fn of<'a>(&'a mut self, class: PathClass, medium: &'a Medium<'a>) -> Deposit<'a, 't> {
        Deposit { estimate: self, class, medium }
    }
}

/// Arrival of energy at a receiver.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arriving {
    /// Number of the receiver.
    pub receiver: usize,
    /// Direction from the receiver to where it comes from, of any length.
    pub towards: DVec3,
    /// Length of the path over which air has not attenuated its energy yet [m].
    pub length: f64,
    /// Time bin.
    pub bin: usize,
}

/// Where the estimator of one path class brings energy.
pub(crate) struct Deposit<'a, 't> {
    /// The estimate of the batch.
    pub estimate: &'a mut BatchEstimate<'t>,
    class: PathClass,
    /// Medium on the way to the receivers.
    pub medium: &'a Medium<'a>,
}

impl Deposit<'_, '_> {
    /// Adds `energy`, spread but not yet attenuated by the last of the air, to the echogram of a receiver.
    #[inline]
    pub(crate) fn add(&mut self, arriving: Arriving, energy: &mut [Lanes]) {
        let Arriving { receiver, towards, length, bin } = arriving;
        let BatchEstimate { tile, deposits, sums, axes, .. } = &mut *self.estimate;
        self.medium.air.attenuate(length, energy);
        energy.multiply(&tile.receivers[receiver].boundary);
        let first = receiver * axes.columns().fine;
        deposits.add(first, bin, energy);
        for (column, weight) in (first + 1..).zip(axes.weights(receiver, towards).iter().flatten()) {
            deposits.add_times(column, bin, energy, *weight);
        }
        let lanes = energy.len();
        sums[self.class as usize][receiver * lanes..].add(energy);
    }

    /// The same for energy found by a kernel, `gain` times as much of which half its area would have found.
    #[inline]
    pub(crate) fn add_from_kernel(&mut self, arriving: Arriving, energy: &mut [Lanes], gain: f64) {
        self.add(arriving, energy);
        let Arriving { receiver, towards, bin, .. } = arriving;
        let BatchEstimate { tile, kernel, axes, .. } = &mut *self.estimate;
        let coarse = tile.coarse_bins[receiver][bin];
        let columns = axes.columns().coarse;
        let weights = axes.weights(receiver, towards).into_iter().flatten();
        for (column, weight) in std::iter::once(1.0).chain(weights).take(columns).enumerate() {
            // Once more where the sonel lies in half the area too, less all of it where not.
            let kernel = &mut kernel[receiver * columns + column];
            kernel.add_share(coarse as usize, energy, (gain - 1.0) * weight);
        }
    }
}
