//! Mean and standard error of one cell over batches, one batch at a time.
//!
//! For a weighted mean the delete-a-group jackknife of unequal groups ([`crate::jackknife`]) has a closed form: with
//! weights w_g that add up to 1, pseudo-values are the batches themselves and the variance of the mean θ is
//! (1/G) Σ (x_g − θ)² w_g / (1 − w_g). Sums are taken about the first batch, so that nothing cancels.
//!
//! References: [Busing1999] (docs/references.md).

use crate::estimate::StandardError;

/// Running sums over the batches of weight above zero.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moments {
    batches: u32,
    mean: f64,
    first: f64,
    shares: f64,
    deviation: f64,
    squared: f64,
}

impl Moments {
    /// Adds a batch of weight 0 < `weight` < 1 whose estimate is `value`.
    pub(super) fn add(&mut self, weight: f64, value: f64) {
        if self.batches == 0 {
            self.first = value;
        }
        let (share, off) = (weight / (1.0 - weight), value - self.first);
        self.batches += 1;
        self.mean += weight * value;
        self.shares += share;
        self.deviation += share * off;
        self.squared += share * off * off;
    }

    /// Weighted mean.
    pub(super) fn mean(&self) -> f64 {
        self.mean
    }

    /// Standard error of the mean; none of fewer than two batches.
    pub(super) fn error(&self) -> Option<StandardError> {
        let freedom = self.batches.checked_sub(1).filter(|&freedom| freedom > 0)?;
        let shift = self.mean - self.first;
        let sum = self.squared - 2.0 * shift * self.deviation + shift * shift * self.shares;
        Some(StandardError { sigma: (sum.max(0.0) / f64::from(self.batches)).sqrt(), freedom })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jackknife::spread;

    #[test]
    fn the_closed_form_is_the_jackknife() {
        let values = [3.0, 1.0, 4.0, 1.5, 9.0];
        let weights = [0.1, 0.3, 0.2, 0.15, 0.25];
        let mut moments = Moments::default();
        weights.iter().zip(values).for_each(|(&weight, value)| moments.add(weight, value));
        let all: f64 = weights.iter().zip(values).map(|(weight, value)| weight * value).sum();
        let without: Vec<f64> = weights.iter().zip(values).map(|(w, x)| (all - w * x) / (1.0 - w)).collect();
        let jackknife = spread(all, &without, &weights);
        let error = moments.error().unwrap();
        assert!((moments.mean() - all).abs() < 1e-12);
        assert!((error.sigma / jackknife.error.sigma - 1.0).abs() < 1e-12);
        assert_eq!(error.freedom, jackknife.error.freedom);
    }

    #[test]
    fn a_small_spread_about_a_large_mean_survives() {
        let mut moments = Moments::default();
        for batch in 0..32 {
            moments.add(1.0 / 32.0, 1e6 + f64::from(batch % 2) * 1e-3);
        }
        let expected = 0.5e-3 / 31.0_f64.sqrt();
        assert!((moments.error().unwrap().sigma / expected - 1.0).abs() < 1e-6);
    }

    #[test]
    fn one_batch_has_no_spread() {
        let mut moments = Moments::default();
        moments.add(0.5, 1.0);
        assert!(moments.error().is_none());
    }
}
