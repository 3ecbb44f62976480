//! The decay after the end of a record, estimated from its last 10 dB.
//!
//! The correction C of ISO 3382-1: beyond the record the decay goes on as the exponential that fits its last 10 dB. The fit
//! matches the centre of gravity of the energy in the window (the maximum of the likelihood of a truncated exponential), so
//! empty bins do no harm, noise averages out, and an ideal decay is met exactly, whatever the bins. The window grows in
//! tenths of the record until it and the next one span 10 dB: a short window that seems to, as it begins with a strong
//! reflection, does not stand that. A record that decays by less is fitted as a whole.
//!
//! References: [ISO3382-1] (docs/references.md).

use crate::estimate::Unsupported;

/// The window spans 10 dB of energy: k w = ln 10.
const WINDOW_NEPERS: f64 = std::f64::consts::LN_10;
/// Steps in which the window grows. Chosen, not measured; doubled, its width is found twice as finely in twice the time.
const WINDOW_STEPS: usize = 10;
/// The fit looks at this many groups of bins at the most: enough to tell a rate, few enough for large grids.
const GROUPS: usize = 32;
/// Beyond e^−700 a double is zero: such a decay leaves no tail.
const STEEPEST_NEPERS: f64 = 700.0;
/// A centre of gravity that lies before the middle by less than this share is a steady record and rounding.
const ROUNDING: f64 = 1e-9;
/// Most steps of the false position; some eight reach the last bits.
const STEPS: usize = 60;

/// An exponential that follows the record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tail {
    /// Energy after the record, in the unit of the echogram.
    pub energy: f64,
    /// Decay rate of the energy [1/s].
    pub rate: f64,
}

/// Fits the tail to bins with borders `times` [s] and `energy` between them, at least one bin and some energy.
///
/// # Errors
/// When there is a single bin, or the record as a whole does not decay.
pub fn fit(times: &[f64], energy: &[f64]) -> Result<Tail, Unsupported> {
    if energy.len() < 2 {
        return Err(Unsupported::SingleBin);
    }
    let (begin, end) = (times[0], times[times.len() - 1]);
    let mut shorter: Option<Tail> = None;
    for step in 1..=WINDOW_STEPS {
        let wanted = end - (end - begin) * step as f64 / WINDOW_STEPS as f64;
        let first = times.partition_point(|&edge| edge < wanted).min(energy.len() - 1);
        let first = if step == WINDOW_STEPS { 0 } else { first };
        let window = FitWindow::group(&times[first..], &energy[first..]);
        let tail = window.rate().map(|rate| Tail { energy: window.energy_behind(rate), rate });
        let spanning = tail.filter(|tail| tail.rate * window.width() >= WINDOW_NEPERS);
        if let (Some(tail), Some(_)) = (shorter, spanning) {
            return Ok(tail);
        }
        if step == WINDOW_STEPS {
            return tail.ok_or(Unsupported::NotDecaying);
        }
        shorter = spanning;
    }
    Err(Unsupported::NotDecaying)
}

/// The end of the record in groups of bins; times count from its begin.
struct FitWindow {
    edges: Vec<f64>,
    energy: Vec<f64>,
}

impl FitWindow {
    fn group(times: &[f64], energy: &[f64]) -> Self {
        let size = energy.len().div_ceil(GROUPS);
        let mut edges = vec![0.0];
        edges.extend((size..energy.len()).step_by(size).map(|bin| times[bin] - times[0]));
        edges.push(times[energy.len()] - times[0]);
        Self { edges, energy: energy.chunks(size).map(|group| group.iter().sum()).collect() }
    }

    fn width(&self) -> f64 {
        self.edges[self.edges.len() - 1]
    }

    /// Rate of the exponential with this centre of gravity [1/s]; [`None`] where there is too little to see or it rises.
    fn rate(&self) -> Option<f64> {
        let total: f64 = self.energy.iter().sum();
        if total <= 0.0 || self.energy.len() < 2 {
            return None;
        }
        let middles = self.edges.windows(2).map(|edges| 0.5 * (edges[0] + edges[1]));
        let center = middles.zip(&self.energy).map(|(middle, energy)| middle * energy).sum::<f64>() / total;
        if center >= self.center_of(0.0) * (1.0 - ROUNDING) {
            return None;
        }
        let off = |rate: f64| self.center_of(rate) - center;
        let mut high = (1.0 / self.width(), off(1.0 / self.width()));
        let mut low = (0.0, off(0.0));
        while high.1 > 0.0 {
            (low, high) = (high, (2.0 * high.0, off(2.0 * high.0)));
            if high.0 * self.width() > STEEPEST_NEPERS {
                return Some(high.0);
            }
        }
        Some(root(low, high, off))
    }

    /// Centre of gravity [s] of an exponential of `rate` [1/s], in these groups.
    fn center_of(&self, rate: f64) -> f64 {
        let (mut moment, mut total) = (0.0, 0.0);
        for edges in self.edges.windows(2) {
            let width = edges[1] - edges[0];
            let share =
                if rate > 0.0 { -libm::exp(-rate * edges[0]) * libm::expm1(-rate * width) } else { width };
            total += share;
            moment += share * 0.5 * (edges[0] + edges[1]);
        }
        moment / total
    }

    /// Energy of the exponential of `rate` after the window.
    fn energy_behind(&self, rate: f64) -> f64 {
        let total: f64 = self.energy.iter().sum();
        total / libm::expm1(rate * self.width())
    }
}

/// Where `of` is zero between two places with its values there, above zero at the lower and at most zero at the higher one: by the false
/// position, with half the value at an end that stays twice (the Illinois algorithm) [DowellJarratt1971].
fn root(mut low: (f64, f64), mut high: (f64, f64), of: impl Fn(f64) -> f64) -> f64 {
    let (mut last, mut was_low) = (high.0, None);
    for _ in 0..STEPS {
        let at = high.0 - high.1 * (high.0 - low.0) / (high.1 - low.1);
        let value = of(at);
        let (moved, stays) = if value > 0.0 { (&mut low, &mut high) } else { (&mut high, &mut low) };
        *moved = (at, value);
        if was_low.replace(value > 0.0) == Some(value > 0.0) {
            stays.1 *= 0.5;
        }
        if value == 0.0 || (at - last).abs() <= f64::EPSILON * at {
            return at;
        }
        last = at;
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_testkit::exponential::ExponentialDecay;

    fn record(time: f64, bin: f64, count: usize) -> (Vec<f64>, Vec<f64>) {
        let decay = ExponentialDecay { reverberation_time: time, energy: 1.0 };
        ((0..=count).map(|edge| edge as f64 * bin).collect(), decay.bins(bin, count))
    }

    #[test]
    fn an_exponential_is_continued_exactly() {
        for (time, bin, count) in [(1.0, 0.001, 300), (0.5, 0.01, 13), (4.0, 0.001, 900), (0.2, 0.001, 57)] {
            let (times, energy) = record(time, bin, count);
            let tail = fit(&times, &energy).unwrap();
            let decay = ExponentialDecay { reverberation_time: time, energy: 1.0 };
            let expected = libm::exp(-decay.rate() * bin * count as f64);
            assert!((tail.energy / expected - 1.0).abs() < 1e-9, "{} not {expected}", tail.energy);
            assert!((tail.rate / decay.rate() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_steady_or_rising_record_has_no_tail() {
        let times: Vec<f64> = (0..=100).map(|edge| f64::from(edge) * 0.01).collect();
        assert_eq!(fit(&times, &[1.0; 100]), Err(Unsupported::NotDecaying));
        let rising: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(fit(&times, &rising), Err(Unsupported::NotDecaying));
    }

    #[test]
    fn silence_is_followed_by_silence() {
        let times: Vec<f64> = (0..=1000).map(|edge| f64::from(edge) * 0.01).collect();
        let mut energy = vec![0.0; 1000];
        energy[0] = 1.0;
        assert!(fit(&times, &energy).unwrap().energy < 1e-100);
    }
}
