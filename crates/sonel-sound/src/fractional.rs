//! Pulses between samples: windowed sinc.
//!
//! A pulse at the time τ has the samples sinc(n − τ) w((n − τ)/32), w being the Blackman window on −1 … 1 [Laakso1996]. Its spectrum is 1 within
//! 0.01 dB up to 0.9 of the Nyquist frequency, and half of it there; on a sample the pulse is exact.
//!
//! References: [Laakso1996] (docs/references.md).

use std::f64::consts::PI;

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

#[cfg(test)]
mod tests {
    use super::*;

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
