//! Fourier transforms of real signals between which filters are applied: multiplication of spectra is circular convolution of signals.

use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// Fourier transforms of one length.
pub(crate) struct Transform {
    forward: Arc<dyn RealToComplex<f64>>,
    backward: Arc<dyn ComplexToReal<f64>>,
}

/// From 0 Hz to half the sample rate.
pub(crate) type Spectrum = Vec<Complex<f64>>;

impl Transform {
    /// Transforms of signals of so many samples.
    pub(crate) fn new(length: usize) -> Self {
        let mut planner = RealFftPlanner::new();
        Self { forward: planner.plan_fft_forward(length), backward: planner.plan_fft_inverse(length) }
    }

    /// Silence of the length of the transform.
    pub(crate) fn silence(&self) -> Vec<f64> {
        self.forward.make_input_vec()
    }

    /// How many frequencies a spectrum has.
    pub(crate) fn frequencies(&self) -> usize {
        self.forward.complex_len()
    }

    /// Spectrum of samples with silence behind them.
    pub(crate) fn padded(&self, samples: &[f32]) -> Spectrum {
        let mut signal = self.silence();
        signal.iter_mut().zip(samples).for_each(|(place, sample)| *place = f64::from(*sample));
        self.spectrum(signal)
    }

    /// Spectrum of a signal.
    pub(crate) fn spectrum(&self, mut signal: Vec<f64>) -> Spectrum {
        let mut spectrum = self.forward.make_output_vec();
        self.forward.process(&mut signal, &mut spectrum).expect("buffers are the plan's own");
        spectrum
    }

    /// Signal of a spectrum.
    pub(crate) fn signal(&self, mut spectrum: Spectrum) -> Vec<f64> {
        // Rounding may leave these with an imaginary part, which the ends of a real signal's spectrum do not have.
        for end in [0, self.frequencies() - 1] {
            spectrum[end].im = 0.0;
        }
        let mut signal = self.backward.make_output_vec();
        self.backward
            .process(&mut spectrum, &mut signal)
            .expect("the ends of a real signal's spectrum are real");
        let scale = 1.0 / signal.len() as f64;
        signal.iter_mut().for_each(|sample| *sample *= scale);
        signal
    }
}

/// A length of so many samples or a few more whose transform is fast: 5, 6, 7 or 8 times a power of two.
pub(crate) fn fast(samples: usize) -> usize {
    samples.next_multiple_of(samples.next_power_of_two().div_ceil(8))
}

/// A spectrum through a filter of these gains.
pub(crate) fn through(spectrum: &[Complex<f64>], gains: &[f64]) -> Spectrum {
    spectrum.iter().zip(gains).map(|(value, gain)| value * gain).collect()
}
