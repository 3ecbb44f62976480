//! What lies beyond the end of the record: the constant C of ISO 3382-1:2009, 5.3.3.
//!
//! The standard continues a record by an exponential decay with the rate of its last 10 dB. Here that rate is fitted to
//! energies, not to levels, so that empty bins need no exception: the last 10 dB are split in two, and the ratio of their
//! energies determines the exponential that has it. Exact for an exponential decay, whatever the bins.
//!
//! A record that does not fall by 10 dB, or whose end does not fall, is not continued.
//!
//! References: [ISO3382-1] (docs/references.md).

use std::f64::consts::LN_10;

use thiserror::Error;

/// What the fitted part of a record falls by [dB].
const FITTED_DB: f64 = 10.0;
/// What it must fall by once fitted: an end that bends flat is not the decay that was looked for [dB].
const LEAST_DB: f64 = 5.0;
/// Below that the fall of a record is not believed to be one [dB].
const LEAST_FALL_DB: f64 = 10.0;

/// The continuation of a record: energy `energy`·e^(−`rate`·t), t from its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tail {
    /// Energy beyond the record, in the unit of the echogram.
    pub energy: f64,
    /// Decay rate of energy [1/s].
    pub rate: f64,
}

/// Why a record is not continued.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum TailRefusal {
    /// Nothing arrives at the end: there is nothing to continue.
    #[error("nothing arrives at the end of the record")]
    NoEnergy,
    /// Less than 10 dB, or too few bins.
    #[error("the record ends before the decay has fallen by 10 dB; simulate a longer duration")]
    TooShort {
        /// Part of the energy that arrives in the last quarter of the record, 0…1.
        end_share: f64,
    },
    /// The end is level or rises.
    #[error("the end of the record does not decay")]
    NotDecaying {
        /// Part of the energy that arrives in the last quarter of the record, 0…1.
        end_share: f64,
    },
}

/// Fits the end of a curve without tail: `remaining` energy at ascending `times` from 0 (s), 0 at the last.
pub fn fit(times: &[f64], remaining: &[f64]) -> Result<Tail, TailRefusal> {
    let last = times.len() - 1;
    let end = times[last];
    // A first rate from the last two quarters of the record decides how long the last 10 dB are.
    let quarter = node_before(times, 0.75 * end);
    let half = node_before(times, 0.5 * end);
    let end_share = remaining[quarter] / remaining[0];
    if remaining[quarter] <= 0.0 {
        return Err(TailRefusal::NoEnergy);
    }
    if half == quarter {
        return Err(TailRefusal::TooShort { end_share });
    }
    let rough = rate(times, remaining, [half, quarter]).ok_or(TailRefusal::NotDecaying { end_share })?;
    if rough * end < LEAST_FALL_DB * LN_10 / 10.0 {
        return Err(TailRefusal::TooShort { end_share });
    }
    let part = 0.5 * FITTED_DB * LN_10 / 10.0 / rough;
    let middle = node_before(times, end - part).min(last - 1);
    let start = node_before(times, times[middle] - part).min(middle.saturating_sub(1));
    if start == middle {
        return Err(TailRefusal::TooShort { end_share });
    }
    if remaining[middle] <= 0.0 {
        return Err(TailRefusal::NoEnergy);
    }
    let rate = rate(times, remaining, [start, middle]).ok_or(TailRefusal::NotDecaying { end_share })?;
    if rate * (end - times[start]) < LEAST_DB * LN_10 / 10.0 {
        return Err(TailRefusal::NotDecaying { end_share });
    }
    let energy = remaining[middle] / libm::expm1(rate * (end - times[middle]));
    Ok(Tail { energy, rate })
}

/// Last node at or before `time`; the first one for what lies before it.
fn node_before(times: &[f64], time: f64) -> usize {
    times.partition_point(|node| *node <= time).max(1) - 1
}

/// Rate of the exponential whose energies between nodes `start`, `middle` and the end are those of the record; none unless it
/// decays.
///
/// The ratio of the energies is (e^(k·a) − 1)/(1 − e^(−k·b)) with a and b the durations of the parts: it rises
/// with the rate k, from a/b at 0.
fn rate(times: &[f64], remaining: &[f64], [start, middle]: [usize; 2]) -> Option<f64> {
    let (a, b) = (times[middle] - times[start], times[times.len() - 1] - times[middle]);
    let ratio = (remaining[start] - remaining[middle]) / remaining[middle];
    // The start is exact for equal parts; a ratio below the limit or not a number at all is no decay.
    let excess = libm::log(ratio * b / a);
    if !(excess > 0.0 && excess.is_finite()) {
        return None;
    }
    let target = libm::log(ratio);
    let mut k = 2.0 * excess / (a + b);
    for _ in 0..60 {
        let (up, down) = (libm::expm1(k * a), -libm::expm1(-k * b));
        let miss = libm::log(up / down) - target;
        let slope = a * (1.0 + 1.0 / up) - b * (1.0 - down) / down;
        let next = k - miss / slope;
        // Newton's step may not leave the half line of decays.
        let next = if next > 0.0 { next } else { 0.5 * k };
        let settled = (next - k).abs() <= 1e-15 * next;
        k = next;
        if settled {
            break;
        }
    }
    (k.is_finite() && k > 0.0).then_some(k)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curve e^(−k t) without what lies beyond its last node.
    fn exponential(times: &[f64], k: f64) -> Vec<f64> {
        let end = (-k * times[times.len() - 1]).exp();
        times.iter().map(|time| (-k * time).exp() - end).collect()
    }

    #[test]
    fn an_exponential_is_continued_exactly_whatever_the_nodes() {
        let even: Vec<f64> = (0..=400).map(|i| f64::from(i) * 0.002).collect();
        let uneven: Vec<f64> = (0..=400).map(|i| f64::from(i) * 0.002 + 0.001 * f64::from(i % 3)).collect();
        for times in [even, uneven] {
            for k in [4.0, 13.8, 60.0] {
                let tail = fit(&times, &exponential(&times, k)).unwrap();
                let expected = (-k * times[400]).exp();
                assert!((tail.rate / k - 1.0).abs() < 1e-9, "{k}: {tail:?}");
                assert!((tail.energy / expected - 1.0).abs() < 1e-8, "{k}: {tail:?}");
            }
        }
    }

    #[test]
    fn a_short_a_level_and_a_silent_end_are_told_apart() {
        let times: Vec<f64> = (0..=100).map(|i| f64::from(i) * 0.01).collect();
        assert!(matches!(fit(&times, &exponential(&times, 1.0)), Err(TailRefusal::TooShort { .. })));
        let level: Vec<f64> = times.iter().map(|time| 1.0 - time).collect();
        assert!(matches!(fit(&times, &level), Err(TailRefusal::NotDecaying { .. })));
        let silent: Vec<f64> = times.iter().map(|time| (0.3 - time).max(0.0)).collect();
        assert_eq!(fit(&times, &silent), Err(TailRefusal::NoEnergy));
        assert!(fit(&[0.0, 1.0], &[1.0, 0.0]).is_err());
    }
}
