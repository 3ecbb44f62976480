//! Delete-one jackknife over batches of unequal weight.
//!
//! An estimate θ of all batches and the estimates θ₍ⱼ₎ without batch j give pseudo-values; their weighted spread is the
//! variance of θ, smooth functions of the batch means provided. Everything is computed from the differences θ − θ₍ⱼ₎, so
//! that what is deterministic has a variance of exactly zero.
//!
//! Few batches with heavy tails make every such interval too short. The largest standardised pseudo-value is therefore tested as an
//! outlier ([`crate::student::largest_deviation`]), at a level that a sound estimate fails once in a thousand.
//!
//! References: [Busing1999] (docs/references.md).

use crate::student;

/// False alarms of the test for heavy tails.
pub const TAIL_SIGNIFICANCE: f64 = 0.001;

/// Batches that take part, by weight; a batch without weight estimates nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    weight: Vec<f64>,
    sum: f64,
    critical_deviation: f64,
    interval_factor: f64,
}

/// What the jackknife says about an estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Standard error of the estimate.
    pub standard_error: f64,
    /// Half of its 95 % interval, from Student's distribution.
    pub half_width: f64,
    /// Degrees of freedom.
    pub degrees: f64,
    /// Whether one batch departs from the others by more than normal numbers would.
    pub heavy_tailed: bool,
}

impl Weights {
    /// Positive weights of at least two batches; none for fewer.
    #[must_use]
    pub fn new(weight: Vec<f64>) -> Option<Self> {
        let (count, sum) = (weight.len(), weight.iter().sum());
        if count < 2 {
            return None;
        }
        let critical_deviation = student::largest_deviation(count, TAIL_SIGNIFICANCE);
        let interval_factor = student::quantile(0.975, (count - 1) as f64);
        Some(Self { weight, sum, critical_deviation, interval_factor })
    }

    /// Number of batches.
    #[must_use]
    pub fn count(&self) -> usize {
        self.weight.len()
    }

    /// Weighted mean of one number per batch. Exact where all are equal.
    #[must_use]
    pub fn mean(&self, values: &[f64]) -> f64 {
        let shift: f64 =
            values.iter().zip(&self.weight).map(|(value, weight)| weight * (value - values[0])).sum();
        values[0] + shift / self.sum
    }

    /// The mean of all but batch `without`, from the mean of all and that batch's own number. Exact where they are equal.
    #[must_use]
    pub fn mean_without(&self, mean: f64, value: f64, without: usize) -> f64 {
        let weight = self.weight[without];
        mean + weight / (self.sum - weight) * (mean - value)
    }

    /// Spread of an estimate from its `deviations` θ − θ₍ⱼ₎, one per batch.
    #[must_use]
    pub fn spread(&self, deviations: &[f64]) -> Spread {
        let count = self.count() as f64;
        let share = |j: usize| self.weight[j] / self.sum;
        // Jackknife estimate minus θ, Busing et al. (1999), equation for unequal groups with m_j/n = share.
        let shift: f64 =
            deviations.iter().enumerate().map(|(j, deviation)| (1.0 - share(j)) * deviation).sum();
        // Pseudo-values relative to the jackknife estimate, scaled to equal variance.
        let residuals: Vec<f64> = deviations
            .iter()
            .enumerate()
            .map(|(j, deviation)| {
                let parts = 1.0 / share(j) - 1.0;
                (parts * deviation - shift) / parts.sqrt()
            })
            .collect();
        let squares: f64 = residuals.iter().map(|residual| residual * residual).sum();
        let standard_error = (squares / count).sqrt();
        let deviation = (squares / (count - 1.0)).sqrt();
        let largest = residuals.iter().fold(0.0_f64, |largest, residual| largest.max(residual.abs()));
        Spread {
            standard_error,
            half_width: self.interval_factor * standard_error,
            degrees: count - 1.0,
            heavy_tailed: deviation > 0.0 && largest > self.critical_deviation * deviation,
        }
    }
}
