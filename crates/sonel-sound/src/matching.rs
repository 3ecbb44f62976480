//! Energies of one realisation as those of the echogram: gains per band and 10 ms.
//!
//! Late sound is a draw, so that the energy of a band in 10 ms scatters by 1/√(Bτ), and T30 of a single response with it. Here every band of
//! the crossover is multiplied with a gain, linear between the middles of the windows, that takes the energy found to the one expected. Both are
//! those of an octave filter, as an analyser reads them: a Butterworth band pass of the third order, 1/(1 + (Q (f/f_m − f_m/f))⁶). Expected is h² ∗ e, the
//! energies e of the band smoothed by the squared response h of the filter [Schroeder1965]: listed arrivals at their times, everything else spread
//! over its bin, without interference and neighbouring bands. As gains move sound to other windows and bands, each round goes half of the way.
//!
//! An analyser with a much sharper or wider filter reads other energies. In 10 ms a band narrower than 50 Hz holds less than one value:
//! octaves of 63 Hz are right in the mean of several windows only.
//!
//! References: [Schroeder1965] (docs/references.md).

use std::ops::Range;

use realfft::num_complex::Complex;

use crate::crossover::Crossover;
use crate::pulses::{Late, Pulses};
use crate::transform::{Spectrum, Transform, through};

/// Windows [s].
const WINDOW: f64 = 0.010;
/// How often the gains are corrected.
const ROUNDS: usize = 20;
/// Most that an amplitude changes by, up or down: windows of few values may be next to empty, and a band below what the filter lets through of its
/// neighbour, 18 dB in octaves, makes room for that.
const MOST: f64 = 100.0;
/// Expected energies below this part of the largest are rounding.
const ROUNDING: f64 = 1e-13;

/// Gains of every band in every window. [B, windows]
pub(crate) type Gains = Vec<Vec<f64>>;

/// Filters and windows.
pub(crate) struct Matching {
    /// Gains of the octave filter of every band. [B, frequencies]
    analysers: Vec<Vec<f64>>,
    /// Bands that are multiplied.
    crossover: Crossover,
    /// Where the response is in the transform [samples].
    place: Range<usize>,
    /// Samples of a window.
    window: usize,
    /// Samples per second.
    rate: f64,
}

impl Matching {
    /// For bands with these centres [Hz], a sample rate [Hz] and the `place` of the response in a transform whose `count` frequencies are `step_hz` apart.
    pub(crate) fn new(
        center_frequency_hz: &[f64],
        (rate, place): (f64, Range<usize>),
        step_hz: f64,
        count: usize,
    ) -> Self {
        let analyser = |band: usize| analyser(center_frequency_hz, band, step_hz, count);
        let analysers = (0..center_frequency_hz.len()).map(analyser).collect();
        // As wide as possible: narrow transitions ring for longer than a window once gains differ.
        let width = center_frequency_hz.windows(2).map(|pair| libm::log2(pair[1] / pair[0]));
        let crossover = Crossover::new(center_frequency_hz, width.fold(1.0, f64::min), step_hz, count);
        Self { analysers, crossover, place, window: libm::round(WINDOW * rate) as usize, rate }
    }

    /// Gains of all rounds for the pressure of this spectrum; `step` is called before each.
    pub(crate) fn rounds(
        &self,
        transform: &Transform,
        pulses: &Pulses,
        mut spectrum: Spectrum,
        step: &dyn Fn(),
    ) -> Vec<Gains> {
        let expected = self.expected(transform, pulses);
        let mut all: Gains = expected.iter().map(|windows| vec![1.0; windows.len()]).collect();
        let round = |_| {
            step();
            let found = |analyser: &Vec<f64>| {
                let signal = transform.signal(through(&spectrum, analyser));
                self.of_windows(&signal, |sample| sample * sample)
            };
            let bands = self.analysers.iter().zip(&expected).zip(&mut all);
            let gains: Gains =
                bands.map(|((analyser, expected), all)| gains(expected, &found(analyser), all)).collect();
            spectrum = self.multiplied(transform, &spectrum, &gains);
            gains
        };
        (0..ROUNDS).map(round).collect()
    }

    /// A spectrum after a round.
    pub(crate) fn multiplied(&self, transform: &Transform, spectrum: &Spectrum, gains: &Gains) -> Spectrum {
        let mut sum = transform.silence();
        for (band, gains) in gains.iter().enumerate() {
            let mut signal = transform.signal(through(spectrum, self.crossover.gains(band)));
            multiply(&mut signal[self.place.clone()], gains, self.window);
            sum.iter_mut().zip(signal).for_each(|(sum, sample)| *sum += sample);
        }
        transform.spectrum(sum)
    }

    /// Expected energies of all windows. [B, windows]
    fn expected(&self, transform: &Transform, pulses: &Pulses) -> Gains {
        let of_band = |(band, analyser): (usize, &Vec<f64>)| {
            let response = transform.signal(analyser.iter().map(|gain| Complex::from(*gain)).collect());
            let smoothing = transform.spectrum(response.into_iter().map(|sample| sample * sample).collect());
            // The spectrum of a signal that is the same backwards is real, but for rounding.
            let smoothing: Vec<f64> = smoothing.into_iter().map(|value| value.re).collect();
            let train = transform.spectrum(self.train(transform, pulses, band));
            self.of_windows(&transform.signal(through(&train, &smoothing)), |energy| energy)
        };
        self.analysers.iter().enumerate().map(of_band).collect()
    }

    /// Squared amplitudes of a band over time: arrivals at their sample, everything else spread over its bin.
    fn train(&self, transform: &Transform, pulses: &Pulses, band: usize) -> Vec<f64> {
        let mut train = transform.silence();
        let place = &mut train[self.place.clone()];
        let last = place.len() - 1;
        let sample = |time: f64| (libm::round(time * self.rate) as usize).min(last);
        let bands = self.analysers.len();
        let listed = pulses.time.iter().zip(pulses.shapes.chunks_exact(bands)).take(pulses.listed);
        for (time, amplitude) in listed {
            place[sample(*time)] += amplitude[band] * amplitude[band];
        }
        for Late { begin, end, squared, .. } in &pulses.late {
            let samples = sample(*begin)..sample(*end).max(sample(*begin) + 1).min(last + 1);
            let share = squared[band] / samples.len() as f64;
            place[samples].iter_mut().for_each(|sum| *sum += share);
        }
        train
    }

    /// Sum of every window of what is given for each sample.
    fn of_windows(&self, signal: &[f64], of_sample: impl Fn(f64) -> f64) -> Vec<f64> {
        let windows = signal[self.place.clone()].chunks(self.window);
        windows.map(|window| window.iter().map(|sample| of_sample(*sample)).sum()).collect()
    }
}

/// Amplitude gains of a filter of octaves, or of the bands between these centres [Hz], at frequencies `step_hz` apart from 0 Hz on.
fn analyser(center_frequency_hz: &[f64], band: usize, step_hz: f64, count: usize) -> Vec<f64> {
    let center = center_frequency_hz[band];
    // Width of the band as a ratio of frequencies: that to the nearest other band.
    let others = center_frequency_hz.iter().filter(|other| (**other - center).abs() > 0.0);
    let width = others.map(|other| (other / center).max(center / other)).fold(f64::INFINITY, f64::min);
    let root = if width.is_finite() { width.sqrt() } else { std::f64::consts::SQRT_2 };
    let quality = 1.0 / (root - 1.0 / root);
    let gain = |index: usize| {
        let ratio = index as f64 * step_hz / center;
        if index == 0 {
            return 0.0;
        }
        1.0 / (1.0 + libm::pow(quality * (ratio - 1.0 / ratio), 6.0)).sqrt()
    };
    (0..count).map(gain).collect()
}

/// Gains that take the energies found half the way [dB] to those expected; `all` is the product of those before and takes them up.
fn gains(expected: &[f64], found: &[f64], all: &mut [f64]) -> Vec<f64> {
    let least = ROUNDING * expected.iter().copied().fold(0.0, f64::max);
    let windows = expected.iter().zip(found).zip(all);
    let gain = |((expected, found), all): ((&f64, &f64), &mut f64)| {
        let before = *all;
        if *expected > least && *found > 0.0 {
            *all = (before * (expected / found).sqrt().sqrt()).clamp(1.0 / MOST, MOST);
        }
        *all / before
    };
    windows.map(gain).collect()
}

/// Multiplies a signal with gains at the middles of windows of so many samples, linear between them.
fn multiply(signal: &mut [f64], gains: &[f64], window: usize) {
    let last = gains.len().saturating_sub(1);
    for (at, sample) in signal.iter_mut().enumerate() {
        let place = ((at as f64 + 0.5) / window as f64 - 0.5).clamp(0.0, last as f64);
        let before = (place as usize).min(last);
        let after = (before + 1).min(last);
        *sample *= gains[before] + (place - before as f64) * (gains[after] - gains[before]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analysers_have_half_the_energy_at_the_borders_of_octaves_and_thirds() {
        for (centers, border) in [
            (&[500.0, 1000.0, 2000.0][..], 2_f64.sqrt()),
            (&[1000.0], 2_f64.sqrt()),
            (&[800.0, 1000.0, 1250.0], 1.25_f64.sqrt()),
        ] {
            let band = centers.len() / 2;
            let gains = analyser(centers, band, 1.0, 4001);
            for frequency in [1000.0 * border, 1000.0 / border] {
                assert!(
                    (gains[frequency.round() as usize].powi(2) - 0.5).abs() < 0.01,
                    "{centers:?} {frequency}"
                );
            }
            assert!(gains[0] == 0.0 && (gains[1000] - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn gains_give_the_energies_and_leave_silence_alone() {
        let mut all = vec![1.0, 1.0, 1.0, 1.0, 1.0, 3.0];
        let found = gains(&[16.0, 1.0, 0.0, 1.0, 1e-20, 1e9], &[1.0, 16.0, 1.0, 0.0, 1.0, 1.0], &mut all);
        for (found, expected) in found.iter().zip([2.0, 0.5, 1.0, 1.0, 1.0, MOST / 3.0]) {
            assert!((found - expected).abs() < 1e-12);
        }
        let mut signal = vec![1.0; 30];
        multiply(&mut signal, &[1.0, 2.0, 1.0], 10);
        assert!(
            (signal[0] - 1.0).abs() < 1e-12
                && (signal[15] - 1.95).abs() < 1e-12
                && (signal[29] - 1.0).abs() < 1e-12
        );
    }
}
