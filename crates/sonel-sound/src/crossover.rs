//! Linear-phase band filters that add up to one.
//!
//! Neighbouring bands meet at the geometric mean of their centres, the border of contiguous octaves or thirds. Around it the
//! amplitude passes from one band to the next as (1 + cos)/2 over 1/24 octave: bands of equal amplitude then make an exact pulse,
//! and a band that decays faster than its neighbour holds less than 2 % of the neighbour's band. Gaps between bands
//! are shared in the same way; the lowest band reaches down to 0 Hz, the highest up to the Nyquist frequency.
//!
//! Linear phase without delay, because a pulse then stays at its time in every band, and because
//! filters that add up to one ring only as far as the amplitudes of neighbouring bands differ. A minimum-phase filter rings after the
//! pulse alone, but delays each band differently and has to be computed for every pulse.

/// Width of the transition between bands [octaves].
const NARROW: f64 = 1.0 / 24.0;

/// Gains of all bands at the frequencies of a Fourier transform.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossover {
    /// [B, frequencies].
    gains: Vec<Vec<f64>>,
}

impl Crossover {
    /// Crossover of bands with these nominal centres [Hz], ascending, at `count` frequencies `step_hz` apart from 0 Hz on.
    #[must_use]
    pub fn new(center_frequency_hz: &[f64], step_hz: f64, count: usize) -> Self {
        let borders: Vec<f64> = center_frequency_hz
            .windows(2)
            .map(|pair| 0.5 * (libm::log2(pair[0]) + libm::log2(pair[1])))
            .collect();
        let octaves: Vec<f64> = (0..count).map(|index| libm::log2(index as f64 * step_hz)).collect();
        // How much of the amplitude belongs to the bands above each border.
        let above = |border: usize, octave: f64| match border.checked_sub(1) {
            None => 1.0,
            Some(index) => borders.get(index).map_or(0.0, |middle| rise((octave - middle) / NARROW)),
        };
        let gain = |band: usize, octave: f64| above(band, octave) - above(band + 1, octave);
        let gains = (0..center_frequency_hz.len())
            .map(|band| octaves.iter().map(|&octave| gain(band, octave)).collect())
            .collect();
        Self { gains }
    }

    /// Gain of a band at every frequency, 0 … 1.
    #[must_use]
    pub fn gains(&self, band: usize) -> &[f64] {
        &self.gains[band]
    }
}

/// From 0 at −1/2 to 1 at 1/2.
fn rise(position: f64) -> f64 {
    let within = position.clamp(-0.5, 0.5);
    0.5 + 0.5 * libm::sin(std::f64::consts::PI * within)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_add_up_to_one_from_zero_to_the_nyquist_frequency() {
        for centers in
            [&[1000.0][..], &[63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0], &[250.0, 2000.0]]
        {
            let crossover = Crossover::new(centers, 10.0, 2401);
            for index in 0..2401 {
                let sum: f64 = (0..centers.len()).map(|band| crossover.gains(band)[index]).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{sum} at {index}");
            }
        }
    }

    #[test]
    fn bands_meet_at_their_borders_and_keep_to_themselves_elsewhere() {
        let crossover = Crossover::new(&[500.0, 1000.0, 2000.0], 1.0, 4001);
        let border = 500.0 * std::f64::consts::SQRT_2;
        assert!((crossover.gains(1)[border.round() as usize] - 0.5).abs() < 0.05);
        for (frequency, gains) in
            [(690, [1.0, 0.0]), (725, [0.0, 1.0]), (1370, [0.0, 1.0]), (1440, [0.0, 0.0])]
        {
            for band in 0..2 {
                assert!((crossover.gains(band)[frequency] - gains[band]).abs() < 1e-12, "{frequency} Hz");
            }
        }
    }
}
