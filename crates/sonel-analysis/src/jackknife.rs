//! Intervals by leaving out one batch at a time.
//!
//! The delete-a-group jackknife for groups of unequal weight [Busing1999]: with h_j = 1/w_j, the estimate θ from all groups
//! and θ_(j) without group j, pseudo-values are τ_j = h_j θ − (h_j − 1) θ_(j), and the variance of θ is
//! (1/G) Σ (τ_j − θ_J)² / (h_j − 1), θ_J = G θ − Σ (1 − w_j) θ_(j). The interval is Student's t with G − 1 degrees of
//! freedom: exact for a linear figure of normal batches, and good for smooth figures of many batches.
//!
//! References: [Busing1999] (docs/references.md).

use crate::outlier;
use crate::student;

/// An interval holds the true value with 95 %.
const MISSED: f64 = 0.05;
/// A relative spread below this is rounding, about which nothing can be tested.
const ROUNDING: f64 = 1e-12;

/// Spread of a figure over its batches.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Half of the 95 % interval, in the unit of the figure.
    pub half_width: f64,
    /// Why the batches look unlike a sample of a normal distribution.
    pub warning: Option<String>,
}

/// Spread of an estimate that is `all` from all batches and `without[j]` without batch j of weight `weight[j]`.
/// Weights are above zero and add up to 1; at least two batches.
#[must_use]
pub fn spread(all: f64, without: &[f64], weight: &[f64]) -> Spread {
    let groups = without.len() as f64;
    let mean =
        groups * all - without.iter().zip(weight).map(|(part, weight)| (1.0 - weight) * part).sum::<f64>();
    // (τ_j − θ_J)/√(h_j − 1) has the same variance for every batch, so these residuals can be compared.
    let residuals: Vec<f64> = without
        .iter()
        .zip(weight)
        .map(|(part, weight)| {
            let share = 1.0 / weight;
            (share * all - (share - 1.0) * part - mean) / (share - 1.0).sqrt()
        })
        .collect();
    let variance = residuals.iter().map(|residual| residual * residual).sum::<f64>() / groups;
    let freedom = without.len() as u32 - 1;
    let noisy = variance.sqrt() > ROUNDING * all.abs();
    Spread {
        half_width: student::quantile(MISSED, freedom) * variance.sqrt(),
        warning: if noisy { outlier::warning(&residuals) } else { None },
    }
}
