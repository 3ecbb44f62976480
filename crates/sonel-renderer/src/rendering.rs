//! What rendering one source yields, and how energy is added to it.

use crate::deposit::{Deposits, TimeBins};
use crate::render::PathClass;
use sonel_map::Lanes;

/// A discrete arrival at a receiver.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscreteArrival {
    /// Index of the receiver.
    pub receiver: usize,
    /// Path length [m].
    pub length: f64,
    /// Fluence per unit emitted energy per band [1/m²].
    pub energy: Vec<f64>,
    /// Unit direction from the receiver to where it seems to come from.
    pub towards: [f64; 3],
    /// Number of reflections; zero for the direct sound.
    pub order: u32,
}

/// Echograms of one source at all receivers.
#[derive(Debug, Clone)]
pub struct Rendering {
    /// Everything: deterministic arrivals plus the weighted mean of the batches [1/m²].
    pub total: Deposits,
    /// Each batch's own estimate at the coarse borders, deterministic arrivals included: [batch][receiver][band][bin].
    pub batches: Vec<Vec<CoarseEchogram>>,
    /// Discrete arrivals that are listed, by receiver and length.
    pub arrivals: Vec<DiscreteArrival>,
    /// Energy per class, summed over receivers and time, per band [1/m²].
    pub classes: [(PathClass, Vec<f64>); 5],
    /// K.
    pub mirror_order: u32,
    /// K′ of every receiver.
    pub image_order: Vec<u32>,
    /// Radius of every receiver's sphere [m].
    pub sphere_radius: Vec<f64>,
}

impl Rendering {
    /// Nothing yet.
    #[must_use]
    pub fn new(receivers: usize, bins: &TimeBins, bands: usize, batches: usize) -> Self {
        Self {
            total: Deposits::new(receivers, bins.count, bands),
            batches: (0..batches).map(|_| Vec::with_capacity(receivers)).collect(),
            arrivals: Vec::new(),
            classes: PathClass::ALL.map(|class| (class, vec![0.0; bands])),
            mirror_order: 0,
            image_order: Vec::new(),
            sphere_radius: Vec::new(),
        }
    }

    /// Books `energy` per band, times `weight`, to `class`.
    pub fn book(&mut self, class: PathClass, weight: f64, energy: &[f64]) {
        for (sum, energy) in self.classes[class as usize].1.iter_mut().zip(energy) {
            *sum += weight * energy;
        }
    }
}

/// Energy of one receiver between coarse borders, [band][bin] [1/m²].
#[derive(Debug, Clone, PartialEq)]
pub struct CoarseEchogram {
    bins: usize,
    energy: Vec<f64>,
}

impl CoarseEchogram {
    /// Nothing between `borders` borders.
    #[must_use]
    pub fn new(borders: usize, bands: usize) -> Self {
        let bins = borders.saturating_sub(1);
        Self { bins, energy: vec![0.0; bins * bands] }
    }

    /// [band][bin].
    #[must_use]
    pub fn energy(&self) -> &[f64] {
        &self.energy
    }

    /// Adds a discrete arrival at `time` [s].
    pub fn add_arrival(&mut self, borders: &[f64], time: f64, energy: &[Lanes]) {
        let bin = borders.partition_point(|&border| border <= time).saturating_sub(1).min(self.bins - 1);
        for band in 0..self.energy.len() / self.bins {
            self.energy[band * self.bins + bin] += energy[band / 4][band % 4];
        }
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
        let mut coarse = 0;
        for bin in 0..bins.count {
            let (start, end) = ((bin as f64 * bins.width).max(first_arrival), (bin + 1) as f64 * bins.width);
            if end <= first_arrival {
                // Rounding may leave a deposit just before the first arrival; it belongs to it.
                self.add_share(
                    fine,
                    receiver,
                    bin,
                    borders.partition_point(|&b| b <= first_arrival).max(1) - 1,
                    1.0,
                );
                continue;
            }
            while coarse + 1 < self.bins && borders[coarse + 1] <= start {
                coarse += 1;
            }
            let (mut at, mut from) = (coarse, start);
            while at + 1 < self.bins && borders[at + 1] < end {
                self.add_share(fine, receiver, bin, at, (borders[at + 1] - from) / (end - start));
                from = borders[at + 1];
                at += 1;
            }
            self.add_share(fine, receiver, bin, at, (end - from) / (end - start));
        }
    }

    fn add_share(&mut self, fine: &Deposits, receiver: usize, bin: usize, coarse: usize, share: f64) {
        for band in 0..self.energy.len() / self.bins {
            self.energy[band * self.bins + coarse] += share * fine.get(receiver, bin, band);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fine_bins_are_divided_at_borders_and_nothing_is_lost() {
        let bins = TimeBins::new(0.01, 0.1, 343.0);
        let mut fine = Deposits::new(1, bins.count, 1);
        for bin in 2..10 {
            fine.add(0, bin, &[[1.0, 0.0, 0.0, 0.0]]);
        }
        let borders = [0.0, 0.022, 0.055, 0.1];
        let mut coarse = CoarseEchogram::new(borders.len(), 1);
        coarse.add_fine(&borders, &fine, 0, &bins, 0.022);
        let expected = [0.0, 3.5, 4.5];
        for (found, expected) in coarse.energy().iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{:?}", coarse.energy());
        }
    }

    #[test]
    fn an_arrival_on_a_border_belongs_to_the_later_bin() {
        let borders = [0.0, 0.5, 1.0];
        let mut coarse = CoarseEchogram::new(3, 2);
        coarse.add_arrival(&borders, 0.5, &[[1.0, 2.0, 0.0, 0.0]]);
        assert_eq!(coarse.energy(), [0.0, 1.0, 0.0, 2.0]);
    }
}
