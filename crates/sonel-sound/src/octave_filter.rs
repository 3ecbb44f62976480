//! Octave filters: Butterworth band passes of the third order (sixth order in all), −3 dB at the borders of the octave.
//!
//! |H|² = 1/(1 + (√2 (f/f_m − f_m/f))⁶). The attenuation lies within class 1 of [IEC61260-1]. Applied to a spectrum they have no phase, so that
//! they delay nothing.
//!
//! References: [IEC61260-1] (docs/references.md).

use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

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
    length: usize,
    rate: f64,
    spectrum: Vec<Complex<f64>>,
    backward: Arc<dyn ComplexToReal<f64>>,
}

impl FilterBank {
    /// The spectrum of `samples` at `rate` [Hz].
    #[must_use]
    pub fn new(samples: &[f32], rate: f64) -> Self {
        let length = (samples.len() + (SILENCE * rate) as usize).next_power_of_two();
        let mut planner = RealFftPlanner::new();
        let forward: Arc<dyn RealToComplex<f64>> = planner.plan_fft_forward(length);
        let (mut input, mut spectrum) = (forward.make_input_vec(), forward.make_output_vec());
        input.iter_mut().zip(samples).for_each(|(place, sample)| *place = f64::from(*sample));
        forward.process(&mut input, &mut spectrum).expect("buffers are the plan's own");
        Self { length, rate, spectrum, backward: planner.plan_fft_inverse(length) }
    }

    /// The signal in the octave about `center` [Hz], as long as the transform; what rings before the beginning stands at the end.
    #[must_use]
    pub fn octave(&self, center: f64) -> Vec<f64> {
        let step = self.rate / self.length as f64;
        let scale = 1.0 / self.length as f64;
        let gain = |index: usize| scale * squared_gain(index as f64 * step, center).sqrt();
        let mut filtered: Vec<Complex<f64>> =
            self.spectrum.iter().enumerate().map(|(index, value)| value * gain(index)).collect();
        // Rounding may leave these with an imaginary part, which the ends of a real signal's spectrum do not have.
        for end in [0, filtered.len() - 1] {
            filtered[end].im = 0.0;
        }
        let mut samples = self.backward.make_output_vec();
        self.backward
            .process(&mut filtered, &mut samples)
            .expect("the ends of a real signal's spectrum are real");
        samples
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
