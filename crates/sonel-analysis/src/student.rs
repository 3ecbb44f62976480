//! Critical values from Student's distribution.
//!
//! References: F. E. Grubbs, Sample criteria for testing outlying observations, *Ann. Math. Statist.* 21(1), 27–58, 1950.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Quantile of Student's distribution: what it exceeds with probability 1 − `probability`. `degrees` at least 1.
#[must_use]
pub fn quantile(probability: f64, degrees: f64) -> f64 {
    distribution(degrees).inverse_cdf(probability)
}

/// Probability that |t| is exceeded by chance with `degrees` of freedom.
#[must_use]
pub fn two_sided(t: f64, degrees: f64) -> f64 {
    2.0 * distribution(degrees).sf(t.abs())
}

/// Largest deviation from the mean, in standard deviations, that one of `count` normal numbers has but with probability
/// `significance` (Grubbs's two-sided test, exact). Infinite for fewer than three numbers.
#[must_use]
pub fn largest_deviation(count: usize, significance: f64) -> f64 {
    if count < 3 {
        return f64::INFINITY;
    }
    let n = count as f64;
    let t = quantile(1.0 - significance / (2.0 * n), n - 2.0);
    (n - 1.0) / n.sqrt() * (t * t / (n - 2.0 + t * t)).sqrt()
}

fn distribution(degrees: f64) -> StudentsT {
    StudentsT::new(0.0, 1.0, degrees.max(1.0))
        .expect("location 0, scale 1 and at least one degree of freedom")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (degrees, expected) in
            [(1.0, 12.706_204_736), (4.0, 2.776_445_105), (31.0, 2.039_513_446), (1e6, 1.959_966)]
        {
            assert!((quantile(0.975, degrees) / expected - 1.0).abs() < 1e-6, "{degrees}");
        }
        assert!((two_sided(2.039_513_446, 31.0) - 0.05).abs() < 1e-9);
    }

    #[test]
    fn the_largest_deviation_is_that_of_grubbs() {
        // Published two-sided critical values at 5 %.
        for (count, expected) in [(3, 1.1543), (10, 2.2900), (30, 2.9085)] {
            assert!((largest_deviation(count, 0.05) - expected).abs() < 2e-4, "{count}");
        }
        assert!(largest_deviation(2, 0.05).is_infinite());
    }
}
