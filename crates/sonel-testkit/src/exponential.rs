//! Ideal exponential decays, in bins, with the closed forms of their room-acoustic parameters.
//!
//! The fluence after the onset is k·E·e^(−k t) with k = 6 ln 10 / T. Parameter code sees bins, not the continuous
//! curve: where the two differ (centre time, modulation transfer) both closed forms are given, the binned one for
//! energy regarded as concentrated in the middle of its bin.
//!
//! References: ISO 3382-1:2009, [Schroeder1981] (docs/references.md).

use std::f64::consts::TAU;

/// An exponential decay that begins at time zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExponentialDecay {
    /// Reverberation time: decay by 60 dB [s]. Also the EDT, T20 and T30.
    pub reverberation_time: f64,
    /// Energy of the whole decay, to infinity, in whatever unit the bins shall have.
    pub energy: f64,
}

impl ExponentialDecay {
    /// Decay rate of the energy k = 6 ln 10 / T [1/s].
    pub fn rate(&self) -> f64 {
        6.0 * std::f64::consts::LN_10 / self.reverberation_time
    }

    /// Energy between two times [s], exact.
    pub fn energy_between(&self, from: f64, to: f64) -> f64 {
        let k = self.rate();
        -self.energy * (-k * from).exp() * (-k * (to - from)).exp_m1()
    }

    /// Energy in each of `count` bins of `bin_width` [s]. What follows the last bin is missing: backward integration
    /// is exact only as far as that part, e^(−k·count·bin_width), is negligible.
    pub fn bins(&self, bin_width: f64, count: usize) -> Vec<f64> {
        (0..count).map(|i| self.energy_between(i as f64 * bin_width, (i + 1) as f64 * bin_width)).collect()
    }

    /// Bins that reach down to `depth_db` below the start.
    pub fn bins_to_depth(&self, bin_width: f64, depth_db: f64) -> Vec<f64> {
        let duration = self.reverberation_time * depth_db / 60.0;
        self.bins(bin_width, (duration / bin_width).ceil() as usize)
    }

    /// Level of the backward-integrated curve at `time` [s], relative to its start [dB].
    pub fn decay_level_db(&self, time: f64) -> f64 {
        -60.0 * time / self.reverberation_time
    }

    /// Early-to-late index C_te = 10 lg((1 − e^(−k te)) / e^(−k te)) [dB], `early` limit te [s]: 0.05 or 0.08.
    pub fn clarity_db(&self, early: f64) -> f64 {
        10.0 * (self.rate() * early).exp_m1().log10()
    }

    /// Early part of the energy D_te = 1 − e^(−k te), 0…1, `early` limit te [s].
    pub fn definition(&self, early: f64) -> f64 {
        -(-self.rate() * early).exp_m1()
    }

    /// Centre time 1/k [s].
    pub fn center_time(&self) -> f64 {
        1.0 / self.rate()
    }

    /// Centre time of the binned decay [s]: (w/2) coth(k w/2).
    pub fn binned_center_time(&self, bin_width: f64) -> f64 {
        0.5 * bin_width / (0.5 * self.rate() * bin_width).tanh()
    }

    /// Modulation transfer 1/√(1 + (2π F/k)²), 0…1, at the modulation frequency F [Hz].
    pub fn modulation_transfer(&self, modulation_frequency_hz: f64) -> f64 {
        1.0 / 1.0_f64.hypot(TAU * modulation_frequency_hz / self.rate())
    }

    /// Modulation transfer of the binned decay: (1 − q)/|1 − q e^(−jωw)| with q = e^(−k w).
    pub fn binned_modulation_transfer(&self, modulation_frequency_hz: f64, bin_width: f64) -> f64 {
        let q = (-self.rate() * bin_width).exp();
        let half_angle = 0.5 * TAU * modulation_frequency_hz * bin_width;
        // |1 − q e^(−jφ)|² = (1 − q)² + 4 q sin²(φ/2), free of cancellation.
        (1.0 - q) / (1.0 - q).hypot(2.0 * q.sqrt() * half_angle.sin())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DECAY: ExponentialDecay = ExponentialDecay { reverberation_time: 1.3, energy: 2.5 };
    const BIN: f64 = 0.001;

    fn bins() -> Vec<f64> {
        DECAY.bins_to_depth(BIN, 200.0)
    }

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance * b.abs(), "{a} against {b}");
    }

    fn transfer(bins: &[f64], frequency: f64) -> f64 {
        let phase = |i: usize| TAU * frequency * BIN * (i as f64 + 0.5);
        let (mut re, mut im) = (0.0, 0.0);
        for (i, e) in bins.iter().enumerate() {
            re += e * phase(i).cos();
            im += e * phase(i).sin();
        }
        re.hypot(im) / bins.iter().sum::<f64>()
    }

    #[test]
    fn the_bins_hold_the_energy_and_fall_by_sixty_decibels() {
        let bins = bins();
        close(bins.iter().sum::<f64>(), 2.5, 1e-12);
        close(10.0 * (bins[1300] / bins[0]).log10(), -60.0, 1e-12);
        let tail = bins[650..].iter().sum::<f64>() / 2.5;
        close(10.0 * tail.log10(), DECAY.decay_level_db(0.65), 1e-12);
    }

    #[test]
    fn early_and_late_energy_are_those_of_the_bins() {
        let bins = bins();
        for (early, count) in [(0.05, 50), (0.08, 80)] {
            let (head, tail) = (bins[..count].iter().sum::<f64>(), bins[count..].iter().sum::<f64>());
            close(DECAY.clarity_db(early), 10.0 * (head / tail).log10(), 1e-9);
            close(DECAY.definition(early), head / (head + tail), 1e-12);
        }
        assert!((DECAY.definition(0.05) - DECAY.definition(0.051)).abs() > 1e-3);
    }

    #[test]
    fn the_centre_time_of_the_bins_is_its_own_closed_form() {
        let first = bins().iter().enumerate().map(|(i, e)| e * (i as f64 + 0.5) * BIN).sum::<f64>();
        close(DECAY.binned_center_time(BIN), first / 2.5, 1e-11);
        close(DECAY.center_time(), 1.3 / 13.815_510_557_964_274, 1e-12);
        let relative = DECAY.binned_center_time(BIN) / DECAY.center_time() - 1.0;
        assert!(relative > 1e-6 && relative < 1e-4, "bins are seen: {relative}");
    }

    #[test]
    fn the_modulation_transfer_of_the_bins_is_its_own_closed_form() {
        for frequency in [0.63, 2.0, 12.5] {
            close(DECAY.binned_modulation_transfer(frequency, BIN), transfer(&bins(), frequency), 1e-10);
            let coarse = DECAY.modulation_transfer(frequency);
            close(coarse, DECAY.binned_modulation_transfer(frequency, 1e-6), 1e-8);
        }
        let other = ExponentialDecay { reverberation_time: 1.31, ..DECAY };
        assert!((other.modulation_transfer(2.0) / DECAY.modulation_transfer(2.0) - 1.0).abs() > 1e-3);
    }
}
