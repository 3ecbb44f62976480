//! Convolution of a recording with an impulse response, block by block (overlap-add).
//!
//! Nothing is normalised: a response δ gives the recording back.

use crate::transform::Transform;

/// Shortest transform: blocks are then a quarter of a second or longer.
const SHORTEST: usize = 1 << 14;

/// `signal` convolved with `response`: as many samples as both have together, less one; none where either is empty.
#[must_use]
pub fn convolve(signal: &[f32], response: &[f32]) -> Vec<f32> {
    if signal.is_empty() || response.is_empty() {
        return Vec::new();
    }
    // Twice the response: half of every transform is new signal.
    let length = (2 * response.len()).next_power_of_two().max(SHORTEST);
    let block = length + 1 - response.len();
    let transform = Transform::new(length);
    let filter = transform.padded(response);
    let mut sum = vec![0.0; signal.len() + response.len() - 1];
    for (index, samples) in signal.chunks(block).enumerate() {
        let mut spectrum = transform.padded(samples);
        spectrum.iter_mut().zip(&filter).for_each(|(value, factor)| *value *= factor);
        let convolved = transform.signal(spectrum);
        sum[index * block..].iter_mut().zip(convolved).for_each(|(sum, value)| *sum += value);
    }
    sum.into_iter().map(|value| value as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_give_the_sum_of_products() {
        let noise = |count: usize, seed: u32| -> Vec<f32> {
            let mut state = seed;
            let mut draw = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 / (1 << 23) as f32 - 1.0
            };
            (0..count).map(|_| draw()).collect()
        };
        for (long, short) in [(40_000, 700), (3, 5), (20_000, 9000)] {
            let (signal, response) = (noise(long, 1), noise(short, 2));
            let convolved = convolve(&signal, &response);
            assert_eq!(convolved.len(), long + short - 1);
            for at in (0..convolved.len()).step_by(997) {
                let first = (at + 1).saturating_sub(short);
                let expected: f64 = (first..=at.min(long - 1))
                    .map(|index| f64::from(signal[index]) * f64::from(response[at - index]))
                    .sum();
                assert!((f64::from(convolved[at]) - expected).abs() < 1e-5, "{at}");
            }
        }
    }

    #[test]
    fn a_pulse_gives_the_recording_back_and_nothing_gives_nothing() {
        for (convolved, expected) in
            convolve(&[0.5, -2.0, 3.0], &[0.0, 1.0]).into_iter().zip([0.0, 0.5, -2.0, 3.0])
        {
            assert!((convolved - expected).abs() < 1e-12_f32, "{convolved} instead of {expected}");
        }
        assert!(convolve(&[], &[1.0]).is_empty() && convolve(&[1.0], &[]).is_empty());
    }
}
