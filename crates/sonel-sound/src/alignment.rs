//! Impulse responses without their onset delay, so that those of neighbouring directions can be averaged.
//!
//! The delay of a response is the lag at which its correlation with its minimum-phase version is largest [NamKolarAbel2008], between samples by a
//! parabola. Without it responses of neighbouring directions have their peaks at one time: their mean is no comb filter. Delay and shape
//! are averaged apart.
//!
//! References: [NamKolarAbel2008] (docs/references.md).

use realfft::num_complex::Complex;

use crate::fractional;
use crate::transform::{Spectrum, Transform};

/// Magnitudes below this part of the largest, −100 dB, count as that much for the minimum phase.
const FAINTEST: f64 = 1e-5;
/// Samples before and behind a response below this part of its peak, −140 dB, are left out.
const SILENT: f64 = 1e-7;
/// Steps of a delay in a sample: a pulse on a sample stays one.
const STEPS: f64 = (1 << 20) as f64;

/// A response as its delay and its shape.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Aligned {
    /// Onset delay [samples].
    pub delay: f64,
    /// Place of the first tap, from the delay on [samples].
    pub first: isize,
    /// What is left without the delay; none of a silent response.
    pub taps: Vec<f64>,
}

impl Aligned {
    /// Of taps, with a transform of twice as many samples or more.
    pub(crate) fn new(taps: &[f64], transform: &Transform) -> Self {
        let peak = taps.iter().fold(0.0_f64, |peak, tap| peak.max(tap.abs()));
        if peak <= 0.0 {
            return Self::default();
        }
        let delay = onset(taps, transform);
        let (first, pulse) = fractional::pulse(-delay);
        let mut shape = vec![0.0; taps.len() + pulse.len() - 1];
        for (at, tap) in taps.iter().enumerate() {
            shape[at..].iter_mut().zip(&pulse).for_each(|(sum, value)| *sum += tap * value);
        }
        let is_heard = |tap: &f64| tap.abs() > SILENT * peak;
        let begin = shape.iter().position(is_heard).unwrap_or(0);
        let end = shape.iter().rposition(is_heard).map_or(begin, |last| last + 1);
        Self { delay, first: first + begin as isize, taps: shape[begin..end].to_vec() }
    }

    /// Mean of responses with weights whose sum is 1. Silent ones have no delay.
    pub(crate) fn mean<'a>(parts: impl Iterator<Item = (f64, &'a Self)> + Clone) -> Self {
        let heard = parts.filter(|(weight, part)| *weight > 0.0 && !part.taps.is_empty());
        let first = heard.clone().map(|(_, part)| part.first).min().unwrap_or(0);
        let (mut delay, mut sum, mut taps) = (0.0, 0.0, Vec::new());
        for (weight, part) in heard {
            delay += weight * part.delay;
            sum += weight;
            let begin = (part.first - first) as usize;
            taps.resize(taps.len().max(begin + part.taps.len()), 0.0);
            taps[begin..].iter_mut().zip(&part.taps).for_each(|(all, tap)| *all += weight * tap);
        }
        Self { delay: if sum > 0.0 { delay / sum } else { 0.0 }, first, taps }
    }
}

/// Lag of the largest correlation of taps with their minimum-phase version [samples].
fn onset(taps: &[f64], transform: &Transform) -> f64 {
    let mut padded = transform.silence();
    padded[..taps.len()].copy_from_slice(taps);
    let length = padded.len();
    let spectrum = transform.spectrum(padded);
    let largest = spectrum.iter().fold(0.0_f64, |largest, value| largest.max(value.norm()));
    let logarithms: Spectrum =
        spectrum.iter().map(|value| Complex::from(libm::log(value.norm().max(FAINTEST * largest)))).collect();
    // The cepstrum of a minimum-phase signal is zero before 0: that of the magnitudes, folded.
    let mut cepstrum = transform.signal(logarithms);
    cepstrum[1..length / 2].iter_mut().for_each(|value| *value *= 2.0);
    cepstrum[length / 2 + 1..].fill(0.0);
    let minimum = transform.spectrum(cepstrum);
    let turned = |(value, minimum): (&Complex<f64>, &Complex<f64>)| {
        let (sin, cos) = libm::sincos(minimum.im);
        value * Complex::new(cos, -sin) * libm::exp(minimum.re)
    };
    let correlation = transform.signal(spectrum.iter().zip(&minimum).map(turned).collect());
    // Through a Hann window over frequency, which makes the peak wide enough for a parabola.
    let value = |lag: usize| correlation[lag % length];
    let at = |lag: usize| 0.5 * value(lag + length) + 0.25 * (value(lag + length - 1) + value(lag + 1));
    let lag = (0..taps.len()).fold(0, |best, lag| if at(lag).abs() > at(best).abs() { lag } else { best });
    let sign = at(lag).signum();
    let (before, peak, after) = (sign * at(lag + length - 1), sign * at(lag), sign * at(lag + 1));
    let curvature = before - 2.0 * peak + after;
    let offset = if curvature < 0.0 { (0.5 * (before - after) / curvature).clamp(-0.5, 0.5) } else { 0.0 };
    ((lag as f64 + offset) * STEPS).round() / STEPS
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aligned(taps: &[f64]) -> Aligned {
        Aligned::new(taps, &Transform::new((2 * taps.len()).next_power_of_two()))
    }

    /// Pulses of one sign and the other, on samples and between them; the estimate is off by 2 µs at 48 kHz at most.
    #[test]
    fn the_delay_of_a_pulse_is_its_time() {
        for at in [32.0, 40.0, 40.25, 45.5, 50.8] {
            let mut taps = vec![0.0; 96];
            let (first, values) = fractional::pulse(at);
            for (index, value) in values.iter().enumerate() {
                taps[(first + index as isize) as usize] -= 0.5 * value;
            }
            let found = aligned(&taps);
            assert!((found.delay - at).abs() < 0.1, "{at}: {}", found.delay);
        }
    }

    #[test]
    fn a_pulse_on_a_sample_stays_one_and_silence_has_no_delay() {
        let mut taps = vec![0.0; 20];
        taps[7] = 2.0;
        let pulse = aligned(&taps);
        assert_eq!((pulse.delay, pulse.first, pulse.taps.len()), (7.0, 0, 1));
        let silent = aligned(&[0.0; 20]);
        assert_eq!(silent, Aligned::default());
        let mean = Aligned::mean([(0.5, &pulse), (0.5, &silent)].into_iter());
        assert!((mean.delay - 7.0).abs() < 1e-9 && (mean.taps[0] - 1.0).abs() < 1e-9);
    }
}
