//! Pulses at the ears of a head, summed as spectra.
//!
//! Late sound has tens of thousands of pulses a second, each with a delay and a mean of measured responses of its own. In a spectrum the delay is
//! a turn and the mean a sum over frequencies. In time each would cost the product of the lengths of a pulse and a response.

use std::f64::consts::TAU;

use glam::DVec3;
use realfft::num_complex::Complex;
use sonel_sofa::Weights;

use crate::alignment::Aligned;
use crate::head::Head;
use crate::transform::{Spectrum, Transform};

/// Samples whose pulses share a transform. Speed alone depends on it: many more make transforms longer, many fewer more of them.
const BLOCK: usize = 64;

/// The responses of a head as spectra.
pub(crate) struct Ears<'h> {
    pub(crate) head: &'h Head,
    transform: Transform,
    /// Left and right ear, or every microphone, for each direction of the head, without delays.
    spectra: Vec<Vec<Spectrum>>,
    /// Samples before a pulse at which its responses may begin.
    pub(crate) lead: usize,
    /// Samples behind it at which they end.
    pub(crate) end: usize,
}

impl<'h> Ears<'h> {
    /// Transforms the responses of a `head`.
    pub(crate) fn new(head: &'h Head) -> Self {
        let responses = || head.responses.iter().flatten();
        let lead = responses().map(|response| (-response.first).max(0) as usize).max().unwrap_or(0);
        let ends = responses().map(|response| {
            response.delay.ceil() as usize + response.taps.len().saturating_add_signed(response.first)
        });
        let end = ends.max().unwrap_or(0);
        let transform = Transform::new((lead + BLOCK + end).next_power_of_two());
        let spectrum = |response: &Aligned| {
            let mut signal = transform.silence();
            let places = signal.len();
            for (at, tap) in (response.first..).zip(&response.taps) {
                signal[at.rem_euclid(places as isize) as usize] = *tap;
            }
            transform.spectrum(signal)
        };
        let spectra = head.responses.iter().map(|ears| ears.iter().map(spectrum).collect()).collect();
        Self { head, transform, spectra, lead, end }
    }

    /// Sum at one ear of pulses with their times [samples], gains and weights of directions: the number of its first sample, and the samples from
    /// there on.
    pub(crate) fn sum(&self, ear: usize, mut pulses: Vec<(f64, f64, &Weights)>) -> (isize, Vec<f64>) {
        pulses.sort_by(|a, b| a.0.total_cmp(&b.0));
        let block = |pulse: &(f64, f64, &Weights)| (pulse.0 / BLOCK as f64).floor() as isize;
        let begin = |number: isize| number * BLOCK as isize - self.lead as isize;
        let Some(first) = pulses.first().map(block) else { return (0, Vec::new()) };
        let mut sum = Vec::new();
        let mut turns = vec![Complex::ONE; self.transform.frequencies()];
        for together in pulses.chunk_by(|a, b| block(a) == block(b)) {
            let number = block(&together[0]);
            let mut spectrum = vec![Complex::ZERO; turns.len()];
            for &(at, gain, weights) in together {
                self.turn(&mut turns, at - begin(number) as f64 + self.head.delay(weights, ear));
                let [one, two, three] = weights.map(|(index, _)| &self.spectra[index][ear]);
                let [of_one, of_two, of_three] = weights.map(|(_, weight)| gain * weight);
                for (((sum, turn), one), (two, three)) in
                    spectrum.iter_mut().zip(&turns).zip(one).zip(two.iter().zip(three))
                {
                    *sum += turn * (one * of_one + two * of_two + three * of_three);
                }
            }
            let place = (begin(number) - begin(first)) as usize;
            let signal = self.transform.signal(spectrum);
            sum.resize(sum.len().max(place + signal.len()), 0.0);
            sum[place..].iter_mut().zip(signal).for_each(|(sum, value)| *sum += value);
        }
        (begin(first), sum)
    }

    /// Sets the factors by which a delay [samples] turns every frequency.
    fn turn(&self, turns: &mut [Complex<f64>], delay: f64) {
        let angle = -TAU * delay / (2 * (turns.len() - 1)) as f64;
        let mut known = 1;
        // From twice to twice as many: products that do not wait for one another.
        while known < turns.len() {
            let (sin, cos) = libm::sincos(angle * known as f64);
            let (done, next) = turns.split_at_mut(known);
            next.iter_mut().zip(done).for_each(|(next, done)| *next = *done * Complex::new(cos, sin));
            known *= 2;
        }
    }
}

impl Head {
    /// Impulse response for the unit vector `u` towards the source, x front, y left, z up, at the left (0) or right (1) ear: samples from
    /// when sound would arrive at the centre of the head.
    #[must_use]
    pub fn response(&self, u: DVec3, ear: usize) -> Vec<f64> {
        let (begin, samples) = Ears::new(self).sum(ear, vec![(0.0, 1.0, &self.weights(u))]);
        samples.into_iter().skip((-begin).max(0) as usize).collect()
    }
}
