//! Echo criterion of Dietsch and Kraak: whether a strong late reflection is noticed as an echo.
//!
//! The build-up of the centre time ts(τ) = ∫₀^τ t |p|ⁿ dt / ∫₀^τ |p|ⁿ dt has a step where an echo arrives. EK = max over τ of
//! (ts(τ) − ts(τ − Δτ)) / Δτ. Half of the listeners notice an echo where EK exceeds 1.0 for speech (n = 2/3, Δτ = 9 ms, octave 1000 Hz) and 1.8 for
//! music (n = 1, Δτ = 14 ms, octaves 1000 and 2000 Hz).
//!
//! Limits: |p| is the root of the energy in windows of 1 ms, about the length of a pulse in these octaves. Diffuse sound counts by its mean energy,
//! so its fluctuation, and the interference of reflections within a window, are not there. There is no interval.
//!
//! Reference: [DietschKraak1986] (docs/references.md).

use sonel_echogram::Response;

use crate::estimate::{Estimate, NoInterval, ParameterValue, Unsupported};

/// What a value is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EchoCriterion {
    /// Name in tables.
    pub name: &'static str,
    /// Name in CSV and JSON.
    pub key: &'static str,
    /// Exponent of |p|.
    exponent: f64,
    /// Δτ [s].
    step: f64,
    /// Value at which half of the listeners notice an echo.
    pub limit: f64,
    /// Lowest and highest frequency [Hz], and the octaves in words.
    range_hz: [f64; 2],
    octaves: &'static str,
}

/// Speech and music.
pub const ECHO_CRITERIA: [EchoCriterion; 2] = [
    EchoCriterion {
        name: "speech",
        key: "echo_criterion_speech",
        exponent: 2.0 / 3.0,
        step: 0.009,
        limit: 1.0,
        range_hz: [707.0, 1414.0],
        octaves: "1000",
    },
    EchoCriterion {
        name: "music",
        key: "echo_criterion_music",
        exponent: 1.0,
        step: 0.014,
        limit: 1.8,
        range_hz: [707.0, 2828.0],
        octaves: "1000 and 2000",
    },
];

/// Length of a window [s].
const WINDOW: f64 = 0.001;
/// Rounding of the width of a bin, relative to it.
const ROUNDING: f64 = 1e-6;

/// Values of [`ECHO_CRITERIA`] for source `s` at receiver `r`.
pub fn echo(response: &Response, s: usize, r: usize) -> [ParameterValue; 2] {
    ECHO_CRITERIA.map(|criterion| {
        let windows = windows(response, s, r, &criterion)?;
        Ok(Estimate::bare(criterion.value(&windows)?, Err(NoInterval::NotOfBatches)))
    })
}

/// Energy of windows since the direct sound, summed over the bands with the power of the source.
fn windows(
    response: &Response,
    s: usize,
    r: usize,
    criterion: &EchoCriterion,
) -> Result<Vec<f64>, Unsupported> {
    let [low, high] = criterion.range_hz;
    let bands: Vec<usize> =
        (0..response.bands()).filter(|&b| (low..high).contains(&response.center_frequency_hz[b])).collect();
    let reaches = |hz: f64| bands.iter().any(|&b| response.center_frequency_hz[b] >= hz / 1.3);
    if bands.is_empty() || !reaches(high / 1.42) {
        return Err(Unsupported::OctavesMissing {
            octaves: criterion.octaves,
            missing: "one of them".to_owned(),
        });
    }
    let edges = &response.time_edges_s;
    let widest = edges.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    if widest > WINDOW * (1.0 + ROUNDING) {
        return Err(Unsupported::BinsBeyondEchoes { width_ms: 1e3 * widest });
    }
    let direct = response.direct_time(s, r);
    let mut windows = Vec::new();
    for b in bands {
        let power = libm::pow(10.0, 0.1 * response.source_power_level_db[s * response.bands() + b]);
        for (pair, energy) in edges.windows(2).zip(response.echogram(s, r, b)) {
            if pair[1] <= direct {
                continue;
            }
            let since = (0.5 * (pair[0] + pair[1]) - direct).max(0.0);
            let index = (since / WINDOW) as usize;
            if windows.len() <= index {
                windows.resize(index + 1, 0.0);
            }
            windows[index] += power * energy;
        }
    }
    Ok(windows)
}

impl EchoCriterion {
    /// EK of the energies of windows.
    fn value(&self, windows: &[f64]) -> Result<f64, Unsupported> {
        if !windows.iter().any(|energy| *energy > 0.0) {
            return Err(Unsupported::NoEnergy);
        }
        let (mut moment, mut sum) = (0.0, 0.0);
        let center: Vec<f64> = windows
            .iter()
            .enumerate()
            .map(|(index, energy)| {
                let amplitude = libm::pow(*energy, 0.5 * self.exponent);
                moment += amplitude * index as f64 * WINDOW;
                sum += amplitude;
                if sum > 0.0 { moment / sum } else { 0.0 }
            })
            .collect();
        let lag = (self.step / WINDOW).round() as usize;
        let before = |index: usize| index.checked_sub(lag).map_or(0.0, |before| center[before]);
        let steps = center.iter().enumerate().map(|(index, time)| (time - before(index)) / self.step);
        Ok(steps.fold(0.0, f64::max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_echo_has_the_step_of_the_formula() {
        let [speech, music] = ECHO_CRITERIA;
        for (criterion, energy) in [(speech, 1.0_f64), (speech, 0.1), (music, 1.0), (music, 0.1)] {
            let mut windows = vec![0.0; 200];
            (windows[0], windows[60]) = (1.0, energy);
            let weight = energy.powf(0.5 * criterion.exponent);
            let wanted = 0.06 * weight / (1.0 + weight) / criterion.step;
            let found = criterion.value(&windows).unwrap();
            assert!((found / wanted - 1.0).abs() < 1e-9, "{found} {wanted}");
            assert!(found > criterion.limit || energy < 1.0);
        }
    }

    #[test]
    fn an_even_decay_is_no_echo_and_a_late_reflection_in_it_is() {
        let [speech, music] = ECHO_CRITERIA;
        for criterion in [speech, music] {
            // T = 1 s behind direct sound 5 dB below the energy of the decay.
            let mut windows: Vec<f64> = (0..1000).map(|i| (-0.0138 * f64::from(i)).exp()).collect();
            windows[0] += 23.0;
            assert!(criterion.value(&windows).unwrap() < 0.7 * criterion.limit, "{criterion:?}");
            // A wall far behind that focuses: 20 dB over the direct sound.
            windows[150] += 2300.0;
            assert!(criterion.value(&windows).unwrap() > criterion.limit, "{criterion:?}");
        }
        assert_eq!(speech.value(&[0.0; 5]), Err(Unsupported::NoEnergy));
    }
}
