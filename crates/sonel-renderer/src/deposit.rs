//! Echograms under construction: energy per receiver, time bin and band.

use sonel_map::{Lanes, lanes_of};

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

    /// Travel time over `length` [s].
    #[must_use]
    pub fn time(&self, length: f64) -> f64 {
        length / self.speed_of_sound
    }
}

/// Energy per receiver, bin and band [1/m²].
#[derive(Debug, Clone)]
pub struct Deposits {
    bins: usize,
    lanes: usize,
    energy: Vec<Lanes>,
}

impl Deposits {
    /// Empty echograms.
    #[must_use]
    pub fn new(receivers: usize, bins: usize, bands: usize) -> Self {
        let lanes = lanes_of(bands);
        Self { bins, lanes, energy: vec![[0.0; 4]; receivers * bins * lanes] }
    }

    /// Adds `energy`, per band, at `bin` of `receiver`.
    #[inline]
    pub fn add(&mut self, receiver: usize, bin: usize, energy: &[Lanes]) {
        debug_assert!(energy.iter().flatten().all(|value| value.is_finite() && *value >= 0.0));
        let at = (receiver * self.bins + bin) * self.lanes;
        for (slot, energy) in self.energy[at..at + self.lanes].iter_mut().zip(energy) {
            for lane in 0..4 {
                slot[lane] += energy[lane];
            }
        }
    }

    /// Adds `weight` times the echogram of receiver `theirs` of `other` to receiver `mine`.
    pub fn add_receiver(&mut self, mine: usize, other: &Self, theirs: usize, weight: f64) {
        let length = self.bins * self.lanes;
        let (to, from) = (mine * length, theirs * length);
        for (slot, energy) in self.energy[to..to + length].iter_mut().zip(&other.energy[from..from + length])
        {
            for lane in 0..4 {
                slot[lane] += weight * energy[lane];
            }
        }
    }

    /// Energy of `receiver` in `bin` and `band`.
    #[inline]
    #[must_use]
    pub fn get(&self, receiver: usize, bin: usize, band: usize) -> f64 {
        self.energy[(receiver * self.bins + bin) * self.lanes + band / 4][band % 4]
    }

    /// Sum over time and receivers, per band.
    #[must_use]
    pub fn totals(&self, bands: usize) -> Vec<f64> {
        let mut totals = vec![0.0; bands];
        for row in self.energy.chunks_exact(self.lanes) {
            for (band, total) in totals.iter_mut().enumerate() {
                *total += row[band / 4][band % 4];
            }
        }
        totals
    }
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
