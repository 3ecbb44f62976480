//! Tests of an estimate against its expected value, by its standard error.
//!
//! Two ways: a p-value ([`z_test`]), or a bound in standard errors ([`within_sigmas`], [`agree`]). The second
//! demands a stated largest standard error, since an estimate that is uncertain enough agrees with everything:
//! such a test could not fail.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use thiserror::Error;

/// A value and the standard deviation of its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value, in whatever unit.
    pub value: f64,
    /// Its standard error, in the same unit.
    pub sigma: f64,
}

impl Estimate {
    /// Mean of independent samples, with the standard error of the mean. The error is NaN for fewer than two.
    pub fn of(samples: &[f64]) -> Self {
        let count = samples.len() as f64;
        let value = samples.iter().sum::<f64>() / count;
        let squares = samples.iter().map(|x| (x - value) * (x - value)).sum::<f64>();
        Self { value, sigma: (squares / (count - 1.0) / count).sqrt() }
    }

    /// Standard error as a part of the value.
    pub fn relative_sigma(&self) -> f64 {
        self.sigma / self.value.abs()
    }
}

/// How closely an estimate has to agree, and how good it has to be for that to mean anything.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Within {
    /// Largest deviation, in standard errors. Four is exceeded once in 16 000 by chance.
    pub sigmas: f64,
    /// Largest admissible standard error, in the unit of the estimate.
    pub maximal_sigma: f64,
}

/// Why an estimate fails the test.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Disagreement {
    /// Value or expectation is not a finite number.
    #[error("cannot compare {value} with {expected}")]
    NotFinite {
        /// The value.
        value: f64,
        /// What it was compared with.
        expected: f64,
    },
    /// A standard error of zero, below zero, infinite or NaN: it was not measured.
    #[error("a standard error of {0} is no measurement")]
    NoSigma(f64),
    /// The standard error is so large that the test would say nothing.
    #[error("standard error {sigma:e} exceeds the stated {maximal:e}: take more samples")]
    TooUncertain {
        /// The standard error.
        sigma: f64,
        /// The largest admissible.
        maximal: f64,
    },
    /// The value is too far off.
    #[error("{value} is {deviation:.2} standard errors ({sigma:e}) from {expected}, more than {allowed}")]
    TooFar {
        /// The value.
        value: f64,
        /// Its standard error.
        sigma: f64,
        /// What it was compared with.
        expected: f64,
        /// Deviation in standard errors, signed.
        deviation: f64,
        /// The allowed number of standard errors.
        allowed: f64,
    },
}

/// Whether `estimate` lies within the stated number of its standard errors from an exactly known value.
///
/// # Errors
/// When it does not, and also when its standard error is zero, NaN or larger than stated.
pub fn within_sigmas(estimate: Estimate, expected: f64, within: Within) -> Result<(), Disagreement> {
    let Estimate { value, sigma } = estimate;
    if !value.is_finite() || !expected.is_finite() {
        return Err(Disagreement::NotFinite { value, expected });
    }
    if !(sigma > 0.0 && sigma.is_finite()) {
        return Err(Disagreement::NoSigma(sigma));
    }
    if sigma > within.maximal_sigma || within.maximal_sigma.is_nan() {
        return Err(Disagreement::TooUncertain { sigma, maximal: within.maximal_sigma });
    }
    let deviation = (value - expected) / sigma;
    if deviation.abs() <= within.sigmas {
        return Ok(());
    }
    Err(Disagreement::TooFar { value, sigma, expected, deviation, allowed: within.sigmas })
}

/// Whether two independent estimates agree within the stated number of their joint standard errors.
///
/// # Errors
/// As [`within_sigmas`], with the joint standard error √(σ₁² + σ₂²); one of the two alone may be zero.
pub fn agree(first: Estimate, second: Estimate, within: Within) -> Result<(), Disagreement> {
    let sigma = first.sigma.hypot(second.sigma);
    within_sigmas(Estimate { value: first.value, sigma }, second.value, within)
}

/// What is known about the variance of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Variance {
    /// Exactly, from theory.
    Known(f64),
    /// Only what the samples say: Student's distribution instead of the normal.
    Estimated,
}

/// Probability that the mean of independent, equally distributed samples is at least as far from `expected` as
/// observed, if `expected` is true (two-sided).
///
/// Holds for enough samples that their mean is normal. Zero when no variance is left to explain a deviation.
pub fn z_test(samples: &[f64], expected: f64, variance: Variance) -> f64 {
    let estimate = Estimate::of(samples);
    let count = samples.len() as f64;
    let sigma = match variance {
        Variance::Known(variance) => (variance / count).sqrt(),
        Variance::Estimated => estimate.sigma,
    };
    if !(sigma > 0.0 && sigma.is_finite() && estimate.value.is_finite() && expected.is_finite()) {
        return 0.0;
    }
    let z = ((estimate.value - expected) / sigma).abs();
    let tail = match variance {
        Variance::Known(_) => Normal::standard().sf(z),
        Variance::Estimated => StudentsT::new(0.0, 1.0, count - 1.0).map_or(0.0, |student| student.sf(z)),
    };
    2.0 * tail
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uniform::Uniform;

    const WITHIN: Within = Within { sigmas: 4.0, maximal_sigma: 0.01 };

    fn squares(count: usize, seed: u64) -> Vec<f64> {
        let mut numbers = Uniform::new(seed);
        (0..count).map(|_| numbers.next_f64().powi(2)).collect()
    }

    #[test]
    fn the_mean_of_squares_is_a_third_and_not_a_little_more() {
        let samples = squares(20_000, 1);
        within_sigmas(Estimate::of(&samples), 1.0 / 3.0, WITHIN).unwrap();
        let off = within_sigmas(Estimate::of(&samples), 0.35, WITHIN);
        assert!(matches!(off, Err(Disagreement::TooFar { .. })), "{off:?}");
        for variance in [Variance::Estimated, Variance::Known(4.0 / 45.0)] {
            assert!(z_test(&samples, 1.0 / 3.0, variance) > 1e-3);
            assert!(z_test(&samples, 0.35, variance) < 1e-9);
        }
    }

    #[test]
    fn p_values_of_true_hypotheses_are_uniform() {
        for variance in [Variance::Estimated, Variance::Known(4.0 / 45.0)] {
            let mut counts = [0_u64; 10];
            for seed in 0..2000 {
                let p = z_test(&squares(400, seed), 1.0 / 3.0, variance);
                counts[((p * 10.0) as usize).min(9)] += 1;
            }
            let fit = crate::chi_square::goodness_of_fit(&counts, &[0.1; 10]).unwrap();
            assert!(fit.p_value > 1e-3, "{variance:?}: {fit:?}");
        }
    }

    #[test]
    fn known_p_values() {
        // Three samples, mean 1, variance 1 by either account: z = t = √3; tables give 0.0833 and 0.2254.
        let samples = [0.0, 1.0, 2.0];
        assert!((z_test(&samples, 0.0, Variance::Known(1.0)) - 0.083_264_5).abs() < 1e-6);
        assert!((z_test(&samples, 0.0, Variance::Estimated) - 0.225_403_3).abs() < 1e-6);
    }

    #[test]
    fn a_test_that_cannot_fail_is_refused() {
        let refused = |sigma| within_sigmas(Estimate { value: 1.0, sigma }, 1.0, WITHIN).unwrap_err();
        assert!(matches!(refused(0.0), Disagreement::NoSigma(_)));
        assert!(matches!(refused(-1.0), Disagreement::NoSigma(_)));
        assert!(matches!(refused(f64::NAN), Disagreement::NoSigma(_)));
        assert!(matches!(refused(f64::INFINITY), Disagreement::NoSigma(_)));
        assert!(matches!(refused(0.02), Disagreement::TooUncertain { .. }));
        let blind = Within { sigmas: 4.0, maximal_sigma: f64::NAN };
        assert!(within_sigmas(Estimate { value: 1.0, sigma: 0.001 }, 1.0, blind).is_err());
        let lost = Estimate { value: f64::NAN, sigma: 0.001 };
        assert!(matches!(within_sigmas(lost, 1.0, WITHIN), Err(Disagreement::NotFinite { .. })));
        assert!(z_test(&[1.0, 1.0, 1.0], 1.0, Variance::Estimated) < 1e-300);
        assert!(Estimate::of(&[1.0]).sigma.is_nan());
    }

    #[test]
    fn two_estimates_agree_within_their_joint_error() {
        let a = Estimate { value: 1.0, sigma: 0.003 };
        let b = Estimate { value: 1.019, sigma: 0.004 };
        agree(a, b, WITHIN).unwrap();
        assert!(agree(a, Estimate { value: 1.021, ..b }, WITHIN).is_err());
        assert!(agree(Estimate { sigma: 0.0, ..a }, Estimate { sigma: 0.0, ..b }, WITHIN).is_err());
    }
}
