//! Pulses between samples: windowed sinc.
//!
//! A pulse at the time τ has the samples sinc(n − τ) w((n − τ)/32), w being the Blackman window on −1 … 1 [Laakso1996]. Its spectrum is 1 within
//! 0.01 dB up to 0.9 of the Nyquist frequency, and half of it there; on a sample the pulse is exact.
//!
//! References: [Laakso1996] (docs/references.md).

use std::f64::consts::PI;

use glam::Vec4;
use realfft::num_complex::Complex;

/// Samples on either side of a pulse.
pub const HALF: usize = 32;

/// A pulse `at` a time [samples]: the sample [`HALF`] − 1 before the last one that is not after the pulse, and 2 [`HALF`] values from there on.
#[must_use]
pub fn pulse(at: f64) -> (isize, [f64; 2 * HALF]) {
    let (whole, fraction) = (at.floor(), at - at.floor());
    let mut values = [0.0; 2 * HALF];
    let first = 1.0 - HALF as f64 - fraction;
    let circle = |angle: f64| Complex::new(libm::cos(angle), libm::sin(angle));
    // sin π(n − f) = −cos πn sin πf from n = −31 on, and the angle of the window turns by π/32 from sample to sample.
    let mut sine = libm::sin(PI * fraction);
    let mut window = circle(PI * first / HALF as f64);
    let step = circle(PI / HALF as f64);
    for (index, value) in values.iter_mut().enumerate() {
        let offset = first + index as f64;
        let sinc = if offset.abs() < f64::EPSILON { 1.0 } else { sine / (PI * offset) };
        *value = sinc * (0.42 + 0.5 * window.re + 0.08 * (2.0 * window.re * window.re - 1.0));
        sine = -sine;
        window *= step;
    }
    (whole as isize + 1 - HALF as isize, values)
}

/// Steps of a table between two samples: linear in between, off by 5 · 10⁻⁶.
const STEPS: usize = 512;

/// Pulses at steps between samples, to read a signal between its samples.
pub struct Table {
    /// [`STEPS`] + 1 pulses.
    pulses: Vec<[f32; 2 * HALF]>,
}

impl Table {
    /// The table.
    #[must_use]
    pub fn new() -> Self {
        let at = |step: usize| pulse(step as f64 / STEPS as f64).1.map(|value| value as f32);
        let mut pulses: Vec<_> = (0..STEPS).map(at).collect();
        // The pulse on the next sample, with one value less before it and one more behind.
        let mut last = pulses[0];
        last.rotate_right(1);
        pulses.push(last);
        Self { pulses }
    }

    /// First sample of the pulse `at` a time, the pulses in the table before and after it, and its place between them, 0 … 1.
    fn around(&self, at: f64) -> (isize, &[f32; 2 * HALF], &[f32; 2 * HALF], f64) {
        let whole = at.floor();
        let place = (at - whole) * STEPS as f64;
        let step = (place as usize).min(STEPS - 1);
        let first = whole as isize + 1 - HALF as isize;
        (first, &self.pulses[step], &self.pulses[step + 1], place - step as f64)
    }

    /// [`pulse`] from the table.
    #[must_use]
    pub fn pulse(&self, at: f64) -> (isize, [f64; 2 * HALF]) {
        let (first, before, after, share) = self.around(at);
        (
            first,
            std::array::from_fn(|index| {
                let [before, after] = [before, after].map(|pulse| f64::from(pulse[index]));
                before + share * (after - before)
            }),
        )
    }

    /// The values of the pulse that is nearest to one `at` a time: off by at most 1/1024 of a sample.
    #[must_use]
    pub fn nearest(&self, at: f64) -> &[f32; 2 * HALF] {
        let (_, before, after, share) = self.around(at);
        if share < 0.5 { before } else { after }
    }

    /// A signal at the time `at` [samples], which lies [`HALF`] samples or more within it.
    #[must_use]
    pub fn read(&self, signal: &[f32], at: f64) -> f64 {
        let (first, before, after, share) = self.around(at);
        let samples = &signal[first as usize..][..2 * HALF];
        let dot = |pulse: &[f32; 2 * HALF]| {
            let pairs = samples.as_chunks::<4>().0.iter().zip(pulse.as_chunks::<4>().0);
            let sum: Vec4 = pairs.map(|(a, b)| Vec4::from_array(*a) * Vec4::from_array(*b)).sum();
            f64::from(sum.element_sum())
        };
        let (before, after) = (dot(before), dot(after));
        before + share * (after - before)
    }
}

impl Default for Table {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_are_read_between_their_samples() {
        let table = Table::new();
        let tone = |at: f64| (0.7 * PI * at).sin();
        let signal: Vec<f32> = (0..200).map(|at| tone(f64::from(at)) as f32).collect();
        for at in [40.0, 40.001, 41.3, 77.777, 99.9995, 150.5] {
            let found = table.read(&signal, at);
            assert!((found - tone(at)).abs() < 2e-3, "{at}: {found} instead of {}", tone(at));
            let (first, values) = pulse(at);
            let exact: f64 = values
                .iter()
                .enumerate()
                .map(|(index, value)| value * f64::from(signal[first as usize + index]))
                .sum();
            assert!((found - exact).abs() < 1e-5, "{at}: {found} instead of {exact}");
        }
    }

    /// e^(−iωτ) to 0.01 dB and 0.1° up to 0.9 of the Nyquist frequency.
    #[test]
    fn pulses_have_their_delay_and_a_flat_spectrum() {
        for at in [0.0, 0.1, 10.25, 40.5, 99.999, -3.7] {
            let (first, values) = pulse(at);
            for step in 0..90 {
                let omega = PI * f64::from(step) / 100.0;
                let (mut real, mut imaginary) = (0.0, 0.0);
                for (index, value) in values.iter().enumerate() {
                    let phase = omega * (first as f64 + index as f64 - at);
                    real += value * phase.cos();
                    imaginary -= value * phase.sin();
                }
                assert!(
                    (real - 1.0).abs() < 1e-3 && imaginary.abs() < 1.7e-3,
                    "{at} {step}: {real} {imaginary}"
                );
            }
        }
    }

    #[test]
    fn a_pulse_on_a_sample_is_one_sample() {
        let (first, values) = pulse(7.0);
        for (index, value) in values.iter().enumerate() {
            assert!((value - f64::from(u8::from(first + index as isize == 7))).abs() < 1e-12);
        }
    }
}
