//! Echograms under construction: energy per receiver, time bin and band.

use std::alloc::{Layout, handle_alloc_error};

use bytemuck::{Pod, Zeroable};
use sonel_map::{BandClasses, BandValues, Lanes, lanes_of, to_lanes};

/// Time bins of equal width from the emission on, in units of path length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeBins {
    /// Width of a bin [s].
    pub width: f64,
    /// Number of bins.
    pub count: usize,
    /// End of the simulated time, as path length [m].
    pub reach: f64,
    bins_per_length: f64,
    speed_of_sound: f64,
}

impl TimeBins {
    /// Bins of `width` [s] up to `duration` [s]; the last may reach beyond it.
    #[must_use]
    pub fn new(width: f64, duration: f64, speed_of_sound: f64) -> Self {
        // A duration that is a whole number of bins but for rounding has no sliver of a bin behind it.
        let count = libm::ceil(duration / width - 1e-9).max(1.0) as usize;
        let bins_per_length = 1.0 / (speed_of_sound * width);
        Self { width, count, reach: duration * speed_of_sound, bins_per_length, speed_of_sound }
    }

    /// The bin of a path of `length` [m]; [`None`] beyond the simulated time.
    #[inline]
    #[must_use]
    pub fn bin(&self, length: f64) -> Option<usize> {
        let bin = (length * self.bins_per_length) as usize;
        (length <= self.reach).then(|| bin.min(self.count - 1))
    }

    /// Borders of all bins [s].
    #[must_use]
    pub fn edges(&self) -> Vec<f64> {
        (0..=self.count).map(|edge| edge as f64 * self.width).collect()
    }

    /// Path lengths at which the energy under way is taken stock of: after three quarters of the simulated time, and at its end [m].
    #[must_use]
    pub fn marks(&self) -> [f64; 2] {
        [0.75 * self.reach, self.reach]
    }

    /// Travel time over `length` [s].
    #[must_use]
    pub fn time(&self, length: f64) -> f64 {
        length / self.speed_of_sound
    }
}

/// Energy per bin, receiver and band [1/m²]. Receivers stand side by side in a bin, because what one sonel sends to all of
/// them arrives at about the same time.
#[derive(Debug, Clone)]
pub struct Deposits {
    receivers: usize,
    bins: usize,
    lanes: usize,
    lines: Vec<CacheLine>,
}

/// Eight bands on one cache line: a deposit of up to eight bands then touches a single line, which halves the time that
/// scattered deposits wait for memory.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct CacheLine([Lanes; 2]);

impl Deposits {
    /// Empty echograms.
    #[must_use]
    pub fn new(receivers: usize, bins: usize, bands: usize) -> Self {
        let lanes = lanes_of(bands);
        let count = (bins * receivers * lanes).div_ceil(2);
        let lines = bytemuck::allocation::try_zeroed_vec(count).unwrap_or_else(|()| {
            // As for any other vector.
            handle_alloc_error(Layout::array::<CacheLine>(count).unwrap_or(Layout::new::<CacheLine>()))
        });
        Self { receivers, bins, lanes, lines }
    }

    /// Empties the echograms.
    pub fn clear(&mut self) {
        self.lines.fill(CacheLine::zeroed());
    }

    /// Multiplies all energies by `factor`.
    pub fn scale(&mut self, factor: f64) {
        self.energy_mut().scale(factor);
    }

    #[inline]
    fn energy(&self) -> &[Lanes] {
        bytemuck::cast_slice(&self.lines)
    }

    #[inline]
    fn energy_mut(&mut self) -> &mut [Lanes] {
        bytemuck::cast_slice_mut(&mut self.lines)
    }

    /// Adds `energy`, per band, at `bin` of `receiver`.
    #[inline]
    pub fn add(&mut self, receiver: usize, bin: usize, energy: &[Lanes]) {
        debug_assert!(energy.values().all(|value| value.is_finite() && value >= 0.0));
        let at = (bin * self.receivers + receiver) * self.lanes;
        self.energy_mut()[at..].add(energy);
    }

    /// Adds `weight` times `energy`, per band, at `bin` of `receiver`: any sign.
    #[inline]
    pub fn add_times(&mut self, receiver: usize, bin: usize, energy: &[Lanes], weight: f64) {
        let at = (bin * self.receivers + receiver) * self.lanes;
        self.energy_mut()[at..].add_times(energy, weight);
    }

    /// Energy of `receiver` in `bin`, per band.
    #[inline]
    #[must_use]
    pub fn at(&self, receiver: usize, bin: usize) -> &[Lanes] {
        let at = (bin * self.receivers + receiver) * self.lanes;
        &self.energy()[at..at + self.lanes]
    }

    /// Energy of `receiver` in `bin` and `band`.
    #[must_use]
    pub fn get(&self, receiver: usize, bin: usize, band: usize) -> f64 {
        self.at(receiver, bin).band(band)
    }

    /// Energy of `receiver` in all bins of `band`.
    #[must_use]
    pub fn sum(&self, receiver: usize, band: usize) -> f64 {
        (0..self.bins).map(|bin| self.get(receiver, bin, band)).sum()
    }

    /// The same with every band for itself, from classes of bands.
    #[must_use]
    pub fn spread(&self, classes: &BandClasses) -> Self {
        let mut spread = Self::new(self.receivers, self.bins, classes.bands());
        for bin in 0..self.bins {
            for receiver in 0..self.receivers {
                spread.add_times(receiver, bin, &spread_lanes(classes, self.at(receiver, bin)), 1.0);
            }
        }
        spread
    }

    /// Adds `weight` times the echograms of `other` to those of the receivers from `first` on.
    pub fn add_receivers(&mut self, first: usize, other: &Self, weight: f64) {
        let (mine, theirs) = (self.receivers * self.lanes, other.receivers * other.lanes);
        let from = first * self.lanes;
        for (mine, theirs) in
            self.energy_mut().chunks_exact_mut(mine).zip(other.energy().chunks_exact(theirs))
        {
            mine[from..].add_times(theirs, weight);
        }
    }
}

/// Values of the bands, from those of the classes of bands.
#[must_use]
pub fn spread_lanes(classes: &BandClasses, of_class: &[Lanes]) -> Vec<Lanes> {
    to_lanes((0..classes.bands()).map(|band| of_class.band(classes.of(band))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrivals_at_a_border_belong_to_the_later_bin() {
        let bins = TimeBins::new(0.001, 1.0, 500.0);
        assert_eq!(bins.count, 1000);
        assert_eq!(bins.bin(0.5), Some(1));
        assert_eq!(bins.bin(0.499_999), Some(0));
        assert_eq!(bins.bin(500.0), Some(999));
        assert_eq!(bins.bin(500.1), None);
    }

    #[test]
    fn bins_longer_than_the_run_are_one_bin() {
        assert_eq!(TimeBins::new(1.0, 0.3, 343.0).count, 1);
    }
}
