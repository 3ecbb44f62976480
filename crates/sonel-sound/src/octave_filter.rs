//! Octave filters: Butterworth band passes of the third order (sixth order in all), −3 dB at the borders of the octave.
//!
//! |H|² = 1/(1 + (√2 (f/f_m − f_m/f))⁶). The attenuation lies within class 1 of [IEC61260-1]. Applied to a spectrum they have no phase, so that
//! they delay nothing.
//!
//! References: [IEC61260-1] (docs/references.md).

use crate::transform::{Spectrum, Transform};

/// Silence behind a signal in which the filters ring [s].
pub(crate) const SILENCE: f64 = 0.5;

/// |H|² of the octave about `center` at `frequency` [Hz].
#[must_use]
pub fn squared_gain(frequency: f64, center: f64) -> f64 {
    let ratio = frequency / center;
    if ratio <= 0.0 { 0.0 } else { 1.0 / (1.0 + libm::pow(2.0_f64.sqrt() * (ratio - 1.0 / ratio), 6.0)) }
}

/// A signal that is filtered octave by octave.
pub struct FilterBank {
    transform: Transform,
    spectrum: Spectrum,
    /// Distance of the lines of the spectrum [Hz].
    step: f64,
}

impl FilterBank {
    /// The spectrum of `samples` at `rate` [Hz].
    #[must_use]
    pub fn new(samples: &[f32], rate: f64) -> Self {
        let length = (samples.len() + (SILENCE * rate) as usize).next_power_of_two();
        let transform = Transform::new(length);
        Self { spectrum: transform.padded(samples), transform, step: rate / length as f64 }
    }

    /// The signal in the octave about `center` [Hz], as long as the transform; what rings before the beginning stands at the end.
    #[must_use]
    pub fn octave(&self, center: f64) -> Vec<f64> {
        let gain = |line: usize| squared_gain(line as f64 * self.step, center).sqrt();
        let lines = self.spectrum.iter().enumerate();
        self.transform.signal(lines.map(|(line, value)| value * gain(line)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Limits of class 1 [dB] at octaves and fractions from the centre: least and largest attenuation.
    #[test]
    fn the_attenuation_is_within_class_1() {
        let limits = [
            (0.0, -0.4, 0.4),
            (0.125, -0.4, 0.5),
            (0.25, -0.4, 0.7),
            (0.375, -0.4, 1.4),
            (0.499, -0.4, 5.3),
            (0.501, 1.6, f64::INFINITY),
            (1.0, 16.6, f64::INFINITY),
            (2.0, 40.5, f64::INFINITY),
            (3.0, 60.0, f64::INFINITY),
            (4.0, 70.0, f64::INFINITY),
        ];
        for (octaves, least, most) in limits {
            for sign in [-1.0, 1.0] {
                // G = 10^0.3 of base ten.
                let frequency = 1000.0 * libm::pow(10.0, 0.3 * sign * octaves);
                let attenuation = -10.0 * libm::log10(squared_gain(frequency, 1000.0));
                assert!((least..=most).contains(&attenuation), "{octaves} octaves: {attenuation} dB");
            }
        }
    }

    #[test]
    fn a_tone_passes_its_own_octave_alone() {
        let tone: Vec<f32> =
            (0..48_000).map(|at| libm::sin(f64::from(at) * 0.130_899_693_9) as f32).collect();
        let bank = FilterBank::new(&tone, 48_000.0);
        let energy =
            |center: f64| bank.octave(center)[12_000..36_000].iter().map(|p| p * p).sum::<f64>() / 12_000.0;
        assert!((energy(1000.0) - 1.0).abs() < 1e-3, "{}", energy(1000.0));
        assert!(energy(250.0) < 1e-4 && energy(4000.0) < 1e-4);
    }
}
