//! Outlying batches, by Grubbs's test: the sign of a heavy-tailed distribution.
//!
//! Where a few rare paths carry much of the energy, the spread of the batches says little until such a path has been found:
//! intervals are then too short, or ruled by one batch. Grubbs's test finds the latter: the largest deviation from the mean,
//! in standard deviations, against what the largest of G normal values exceeds once in a thousand times.
//!
//! References: [Grubbs1969] (docs/references.md).

use crate::student;

/// Share of valid parameters that are warned of [1]: one in a response of 125 parameters in eight responses. Chosen; doubled, one in four.
const FALSE_ALARMS: f64 = 0.001;
/// Fewest values of a test: with three the largest deviation is nearly fixed by the others.
const FEWEST: usize = 4;

/// A warning where one of `residuals` lies too far from the others.
#[must_use]
pub fn warning(residuals: &[f64]) -> Option<String> {
    if residuals.len() < FEWEST {
        return None;
    }
    let largest = largest_deviation(residuals)?;
    let critical = critical_deviation(FALSE_ALARMS, residuals.len() as u32);
    (largest > critical).then(|| {
        format!(
            "the interval may be too narrow because rare paths carry much of the energy: one of {} batches is {largest:.1} standard \
             deviations from the others (Grubbs's test at 0.1 %: {critical:.1}); trace more packets",
            residuals.len()
        )
    })
}

/// Largest deviation from the mean in standard deviations; none where all values agree.
fn largest_deviation(values: &[f64]) -> Option<f64> {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (count - 1.0);
    let largest = values.iter().map(|value| (value - mean).abs()).fold(0.0, f64::max);
    (variance > 0.0).then(|| largest / variance.sqrt())
}

/// Quantile of the largest deviation of `count` normal values: exceeded with probability `level`.
fn critical_deviation(level: f64, count: u32) -> f64 {
    let n = f64::from(count);
    let t = student::quantile(level / n, count - 2);
    (n - 1.0) / n.sqrt() * (t * t / (n - 2.0 + t * t)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_testkit::uniform::Uniform;

    fn normal(numbers: &mut Uniform) -> f64 {
        let radius = (-2.0 * libm::log1p(-numbers.next_f64())).sqrt();
        radius * libm::cos(std::f64::consts::TAU * numbers.next_f64())
    }

    fn alarms(mut batch: impl FnMut(&mut Uniform) -> f64) -> usize {
        let mut numbers = Uniform::new(7);
        let mut run = || (0..32).map(|_| batch(&mut numbers)).collect::<Vec<f64>>();
        (0..20_000).filter(|_| warning(&run()).is_some()).count()
    }

    /// 20 alarms of 20 000 are expected; outside 6 … 40 with a probability below 1e-3.
    #[test]
    fn one_normal_sample_in_a_thousand_is_warned_of() {
        let alarms = alarms(normal);
        assert!((6..=40).contains(&alarms), "{alarms}");
    }

    /// Energies carried by rare paths: log-normal batches.
    #[test]
    fn heavy_tails_are_found() {
        let alarms = alarms(|numbers| libm::exp(2.0 * normal(numbers)));
        assert!(alarms > 10_000, "{alarms}");
    }

    /// The two-sided table at 5 %.
    #[test]
    fn critical_values_are_those_of_the_tables() {
        for (count, expected) in [(5, 1.715), (10, 2.290), (20, 2.709), (30, 2.908)] {
            assert!((critical_deviation(0.05, count) - expected).abs() < 0.001, "{count}");
        }
    }
}
