//! The rendering of one source, and sums of energy in it.

use std::iter::repeat_n;

use crate::crossings::Crossings;
use crate::deposit::{Deposits, TimeBins, spread_lanes};
use crate::directions::Columns;
use crate::path_class::PathClass;
use sonel_map::{BandClasses, BandValues, Lanes, lanes_of};

/// Relative variance below which values differ by rounding alone [1]: (1e-7)², single precision.
const ROUNDING: f64 = 1e-14;

/// Least decay in a whole run that counts as one [nepers]: 0.04 dB. It keeps the rate positive; doubled, rooms without absorption are taken to
/// decay in half the time.
const SLOWEST_NEPERS: f64 = 0.01;

/// A discrete arrival at a receiver.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscreteArrival {
    /// Index of the receiver.
    pub receiver: usize,
    /// Path length [m], times c₀/c of its air: travel time times the speed of sound of the scene.
    pub length: f64,
    /// Fluence per unit emitted energy per band [1/m²].
    pub energy: Vec<f64>,
    /// Unit direction from the receiver to where it seems to come from.
    pub towards: [f64; 3],
    /// Number of reflections; zero for the direct sound.
    pub order: u32,
    /// Whether it goes over edges, the path without them being shaded.
    pub over_edges: bool,
}

/// Echograms of one source at all receivers.
#[derive(Debug, Clone)]
pub struct Rendering {
    /// Columns of each receiver in `total` and `batches`.
    pub columns: Columns,
    /// Everything: deterministic arrivals plus the weighted mean of the batches [1/m²].
    pub total: Deposits,
    /// Each batch's own estimate at the coarse borders, deterministic arrivals included: [batch][receiver and column].
    pub batches: Vec<Vec<CoarseEchogram>>,
    /// What kernels of half the area would have added to each of them: [batch][receiver and column], see `stochastic::kernel`.
    pub kernel_differences: Vec<Vec<CoarseEchogram>>,
    /// Discrete arrivals that are listed, by receiver and length.
    pub arrivals: Vec<DiscreteArrival>,
    /// Energy per class, summed over receivers and time, per band [1/m²].
    pub classes: [(PathClass, Vec<f64>); PathClass::ALL.len()],
    /// The same for every receiver: [receiver][band] of each class [1/m²].
    pub class_energies: [Vec<f64>; PathClass::ALL.len()],
    /// Weighted mean over the batches of the squares of their energies, as `class_energies`.
    squares: [Vec<f64>; PathClass::ALL.len()],
    /// Packets that passed near the balls of all receivers.
    pub(crate) crossings: Crossings,
    /// Energy under way at [`TimeBins::marks`], per unit emitted energy and band [1].
    pub under_way: [Vec<f64>; 2],
    /// K.
    pub mirror_order: u32,
    /// Radius of every receiver's sphere [m].
    pub sphere_radius: Vec<f64>,
    /// Factors of the boundary term, by receiver and band [1]; no bands without it.
    pub boundary: Vec<Vec<f64>>,
    /// Completeness of the edge contributions at every receiver; empty without edges.
    pub edge_work: Vec<EdgeWork>,
}

/// Completeness of the edge contributions at a receiver.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeWork {
    /// Number of contributions that were computed.
    pub computed: usize,
    /// Standard deviation of what the others would change the energy of each band by, as a share of it.
    pub left_out: Vec<f64>,
}

impl Rendering {
    /// Nothing yet.
    #[must_use]
    pub fn new(receivers: usize, columns: Columns, bins: &TimeBins, bands: usize) -> Self {
        Self {
            columns,
            total: Deposits::new(receivers * columns.fine, bins.count, bands),
            batches: Vec::new(),
            kernel_differences: Vec::new(),
            arrivals: Vec::new(),
            classes: PathClass::ALL.map(|class| (class, vec![0.0; bands])),
            class_energies: PathClass::ALL.map(|_| vec![0.0; receivers * bands]),
            squares: PathClass::ALL.map(|_| vec![0.0; receivers * bands]),
            crossings: Crossings::new(receivers, bands),
            under_way: [vec![0.0; bands], vec![0.0; bands]],
            mirror_order: 0,
            sphere_radius: Vec::new(),
            boundary: Vec::new(),
            edge_work: Vec::new(),
        }
    }

    /// Total energy of a receiver in a band [1/m²].
    #[must_use]
    pub fn energy(&self, receiver: usize, band: usize) -> f64 {
        self.total.sum(receiver * self.columns.fine, band)
    }

    /// The same with every band for itself, from classes of bands.
    #[must_use]
    pub fn spread(self, classes: &BandClasses) -> Self {
        if classes.count() == classes.bands() {
            return self;
        }
        let spread = |batches: Vec<Vec<CoarseEchogram>>| {
            let spread_batch =
                |batch: Vec<CoarseEchogram>| batch.iter().map(|coarse| coarse.spread(classes)).collect();
            batches.into_iter().map(spread_batch).collect()
        };
        let spread_receivers = |bands: Vec<f64>| -> Vec<f64> {
            bands.chunks_exact(classes.count()).flat_map(|bands| classes.spread(bands)).collect()
        };
        let arrivals = self
            .arrivals
            .into_iter()
            .map(|arrival| DiscreteArrival { energy: classes.spread(&arrival.energy), ..arrival });
        Self {
            total: self.total.spread(classes),
            batches: spread(self.batches),
            kernel_differences: spread(self.kernel_differences),
            arrivals: arrivals.collect(),
            classes: self.classes.map(|(class, energy)| (class, classes.spread(&energy))),
            class_energies: self.class_energies.map(spread_receivers),
            squares: self.squares.map(spread_receivers),
            under_way: self.under_way.map(|energy| classes.spread(&energy)),
            ..self
        }
    }

    /// Records `energy` per band at `receiver`, times `weight`, to `class`.
    pub fn record(&mut self, class: PathClass, receiver: usize, weight: f64, energy: &[Lanes]) {
        let class = class as usize;
        let bands = self.classes[class].1.len();
        for band in 0..bands {
            let (energy, at) = (energy.band(band), receiver * bands + band);
            self.classes[class].1[band] += weight * energy;
            self.class_energies[class][at] += weight * energy;
            self.squares[class][at] += weight * energy * energy;
        }
    }

    /// Multiplies everything that is weighed by batches by `factor`.
    pub(crate) fn scale(&mut self, factor: f64) {
        self.total.scale(factor);
        self.crossings.scale(factor);
        let classes = self.classes.iter_mut().map(|(_, energy)| energy);
        let receivers = self.class_energies.iter_mut().chain(&mut self.squares).chain(&mut self.under_way);
        classes.chain(receivers).flatten().for_each(|value| *value *= factor);
    }

    /// Extends the interval of `receiver` by what it may have missed, `unseen` [1/m²], in the bin of the first arrival at `time` [s]: a bias,
    /// half of which a kernel of half the area would show.
    pub fn add_unseen(&mut self, receiver: usize, borders: &[f64], time: f64, unseen: &[Lanes]) {
        if unseen.largest() > 0.0 {
            for batch in &mut self.kernel_differences {
                batch[receiver * self.columns.coarse].add_arrival(borders, time, unseen, 0.5);
            }
        }
    }

    /// Records `energy` under way, times `weight`.
    pub fn add_energy_in_flight(&mut self, weight: f64, energy: &[Vec<Lanes>; 2]) {
        for (sums, energy) in self.under_way.iter_mut().zip(energy) {
            for (band, sum) in sums.iter_mut().enumerate() {
                *sum += weight * energy.band(band);
            }
        }
    }

    /// What arrives after the end of the run, as the mean over a room of `volume` [m³]: fluence per unit emitted energy [1/m²], and the rate at
    /// which the energy of all packets decayed at the end [1/s], both per band.
    ///
    /// The energy E spreads over the volume, so that its fluence is c/V ∫E dt = c E / (V k). A room that hardly decays is taken for one
    /// that decays by 0.01 nepers in the whole run.
    #[must_use]
    pub fn missing(&self, bins: &TimeBins, volume: f64) -> (Vec<f64>, Vec<f64>) {
        let [from, to] = bins.marks();
        let rate = |[before, after]: [f64; 2]| {
            let nepers = if after > 0.0 { libm::log(before / after) } else { SLOWEST_NEPERS };
            (nepers / (to - from)).max(SLOWEST_NEPERS / to)
        };
        let [before, after] = &self.under_way;
        let rates: Vec<f64> =
            before.iter().zip(after).map(|(&before, &after)| rate([before, after])).collect();
        let fluence = after.iter().zip(&rates).map(|(after, rate)| after / (rate * volume)).collect();
        (fluence, rates.iter().map(|rate| rate / bins.time(1.0)).collect())
    }

    /// How many independent equal contributions would scatter as the energy of `class` at `receiver` does between the batches, per band:
    /// mean² over the variance of the mean [1]. [`None`] where nothing scatters.
    #[must_use]
    pub fn effective_sample_size(&self, class: PathClass, receiver: usize, band: usize) -> Option<f64> {
        let (class, at) = (class as usize, receiver * self.classes[class as usize].1.len() + band);
        let (mean, square) = (self.class_energies[class][at], self.squares[class][at]);
        let variance = (square - mean * mean) / (self.batches.len() as f64 - 1.0);
        (variance > ROUNDING * square).then(|| mean * mean / variance)
    }
}

/// Energy of one receiver between coarse borders, per bin and band [1/m²].
#[derive(Debug, Clone, PartialEq)]
pub struct CoarseEchogram {
    lanes: usize,
    energy: Vec<Lanes>,
}

impl CoarseEchogram {
    /// Nothing between `borders` borders.
    #[must_use]
    pub fn new(borders: usize, bands: usize) -> Self {
        let lanes = lanes_of(bands);
        Self { lanes, energy: vec![Lanes::ZERO; borders.saturating_sub(1) * lanes] }
    }

    /// Nothing between the coarse `borders` of each receiver, in so many columns each.
    #[must_use]
    pub fn of_receivers(borders: &[Vec<f64>], columns: usize, bands: usize) -> Vec<Self> {
        let of_receiver = |borders: &Vec<f64>| repeat_n(Self::new(borders.len(), bands), columns);
        borders.iter().flat_map(of_receiver).collect()
    }

    fn spread(&self, classes: &BandClasses) -> Self {
        let energy = self.energy.chunks_exact(self.lanes).flat_map(|bin| spread_lanes(classes, bin));
        Self { lanes: lanes_of(classes.bands()), energy: energy.collect() }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.energy.fill(Lanes::ZERO);
    }

    /// Energy of `band` in every bin.
    pub fn band(&self, band: usize) -> impl Iterator<Item = f64> + '_ {
        self.energy.chunks_exact(self.lanes).map(move |bin| bin.band(band))
    }

    /// Adds what `other` holds between the same borders.
    pub fn add(&mut self, other: &Self) {
        self.energy.add(&other.energy);
    }

    /// Adds `weight` times a discrete arrival at `time` [s].
    pub fn add_arrival(&mut self, borders: &[f64], time: f64, energy: &[Lanes], weight: f64) {
        let bin = borders.partition_point(|&border| border <= time).clamp(1, borders.len() - 1) - 1;
        self.add_share(bin, energy, weight);
    }

    /// Adds the echogram of `receiver` in `fine`, which holds nothing before `first_arrival` [s]. A fine bin across a border
    /// is divided in proportion to its time on either side.
    pub fn add_fine(
        &mut self,
        borders: &[f64],
        fine: &Deposits,
        receiver: usize,
        bins: &TimeBins,
        first_arrival: f64,
    ) {
        let last = borders.len() - 2;
        let mut coarse = 0;
        for bin in 0..bins.count {
            let energy = fine.at(receiver, bin);
            let end = (bin + 1) as f64 * bins.width;
            // Rounding may leave a deposit just before the first arrival; it belongs to it.
            let start = (bin as f64 * bins.width).max(first_arrival.min(end));
            while coarse < last && borders[coarse + 1] <= start {
                coarse += 1;
            }
            let (mut at, mut from) = (coarse, start);
            while at < last && borders[at + 1] < end {
                self.add_share(at, energy, (borders[at + 1] - from) / (end - start));
                from = borders[at + 1];
                at += 1;
            }
            self.add_share(at, energy, if end > start { (end - from) / (end - start) } else { 1.0 });
        }
    }

    /// Adds `share` times `energy` to one of its bins.
    #[inline]
    pub fn add_share(&mut self, coarse: usize, energy: &[Lanes], share: f64) {
        self.energy[coarse * self.lanes..(coarse + 1) * self.lanes].add_times(energy, share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_map::to_lanes;

    #[test]
    fn fine_bins_are_divided_at_borders_and_nothing_is_lost() {
        let bins = TimeBins::new(0.01, 0.1, 343.0);
        let mut fine = Deposits::new(1, bins.count, 1);
        for bin in 2..10 {
            fine.add(0, bin, &to_lanes([1.0]));
        }
        let borders = [0.0, 0.022, 0.055, 0.1];
        let mut coarse = CoarseEchogram::new(borders.len(), 1);
        coarse.add_fine(&borders, &fine, 0, &bins, 0.022);
        let expected = [0.0, 3.5, 4.5];
        for (found, expected) in coarse.band(0).zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{coarse:?}");
        }
    }

    #[test]
    fn an_arrival_on_a_border_belongs_to_the_later_bin() {
        let borders = [0.0, 0.5, 1.0];
        let mut coarse = CoarseEchogram::new(3, 2);
        coarse.add_arrival(&borders, 0.5, &to_lanes([1.0, 2.0]), 1.0);
        assert_eq!(coarse.band(0).collect::<Vec<_>>(), [0.0, 1.0]);
        assert_eq!(coarse.band(1).collect::<Vec<_>>(), [0.0, 2.0]);
    }
}
