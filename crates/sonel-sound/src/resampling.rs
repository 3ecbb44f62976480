//! Other sample rates, by `rubato`'s interpolation with a windowed sinc.

use std::fmt::Display;
use std::ops::RangeInclusive;

use rubato::audioadapter_buffers::direct::InterleavedSlice;
use rubato::{Async, FixedAsync, Resampler, SincInterpolationParameters};

use crate::SoundError;

/// Frames that are converted at a time.
const CHUNK: usize = 1024;
/// Steps of the filter between two samples: its table is off by one of them.
const STEPS: usize = 4096;
/// Rates of recordings: a telephone has 8 kHz, 192 kHz is the usual maximum.
const RATES_HZ: RangeInclusive<u32> = 1000..=768_000;
/// One channel at another rate, of the same duration and level, in time to a sample.
///
/// # Errors
/// When a rate is not one of 1 … 768 kHz.
pub fn resample(signal: &[f32], from_hz: u32, to_hz: u32) -> Result<Vec<f32>, SoundError> {
    if from_hz == to_hz {
        return Ok(signal.to_vec());
    }
    let refused = |problem: &dyn Display| SoundError::Rate { from_hz, to_hz, problem: problem.to_string() };
    if !RATES_HZ.contains(&from_hz) || !RATES_HZ.contains(&to_hz) {
        return Err(refused(&format!("recordings have {} … {} Hz", RATES_HZ.start(), RATES_HZ.end())));
    }
    // Single precision keeps time to a sample in 10⁴ alone.
    let samples: Vec<f64> = signal.iter().map(|sample| f64::from(*sample)).collect();
    let ratio = f64::from(to_hz) / f64::from(from_hz);
    let filter = SincInterpolationParameters::default().oversampling_factor(STEPS);
    let mut resampler = Async::<f64>::new_sinc(ratio, 1.0, &filter, CHUNK, 1, FixedAsync::Input)
        .map_err(|error| refused(&error))?;
    let input = InterleavedSlice::new(&samples, 1, samples.len()).map_err(|error| refused(&error))?;
    let output = resampler.process_all(&input, samples.len(), None).map_err(|error| refused(&error))?;
    // The library rounds the length up in floating point.
    let count = (samples.len() as u64 * u64::from(to_hz)).div_ceil(u64::from(from_hz)) as usize;
    // Its first frame is that of one step after the beginning.
    Ok(std::iter::once(0.0).chain(output.take_data()).take(count).map(|sample| sample as f32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_tone_keeps_its_level_time_and_duration() {
        let tone = |rate: u32, at: usize| libm::sin(TAU * 1000.0 * at as f64 / f64::from(rate));
        for rate in [44_100, 16_000, 96_000, 8000] {
            let signal: Vec<f32> = (0..rate as usize).map(|at| tone(rate, at) as f32).collect();
            let resampled = resample(&signal, rate, 48_000).unwrap();
            assert_eq!(resampled.len(), 48_000, "{rate}");
            let middle = &resampled[2400..45_600];
            let square =
                middle.iter().map(|sample| f64::from(*sample).powi(2)).sum::<f64>() / middle.len() as f64;
            assert!((2.0 * square - 1.0).abs() < 1e-3, "{rate} Hz: {square}");
            // The time is right to a sample, in which the phase turns by 0.13.
            for (at, sample) in middle.iter().enumerate() {
                assert!(
                    (f64::from(*sample) - tone(48_000, at + 2400)).abs() < 0.13,
                    "{rate} Hz, {at}: {sample}"
                );
            }
        }
    }

    #[test]
    fn impossible_rates_are_refused() {
        for rate in [0, 1, 999, 1_000_000] {
            assert!(resample(&[1.0], rate, 48_000).unwrap_err().to_string().contains("another program"));
        }
    }
}
