//! Quantiles of Student's t distribution for whole degrees of freedom.
//!
//! The distribution function is a finite sum for whole ν; its inverse is found by bisection. Plain arithmetic and `libm`,
//! so intervals have the same bits on every platform.
//!
//! References: [AbramowitzStegun1964] 26.7.3 and 26.7.4 (docs/references.md).

use std::f64::consts::{FRAC_PI_2, PI};

/// Probability that a 95 % interval misses the true value.
pub const MISSED: f64 = 0.05;
/// Half of a 95 % interval of a normal distribution [standard deviations].
pub const NORMAL_95: f64 = 1.959_964;
/// Halvings of the angle: to the last bits of a double.
const BISECTIONS: usize = 80;

/// The t that |T| exceeds with probability `two_sided`, 0 < `two_sided` < 1, for `freedom` ≥ 1 degrees of freedom.
#[must_use]
pub fn quantile(two_sided: f64, freedom: u32) -> f64 {
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if central(middle, freedom) < 1.0 - two_sided { low = middle } else { high = middle }
    }
    libm::tan(0.5 * (low + high)) * f64::from(freedom).sqrt()
}

/// P(|T| ≤ t) with t = √ν tan `angle`.
fn central(angle: f64, freedom: u32) -> f64 {
    let (sin, cos) = libm::sincos(angle);
    let odd = freedom % 2 == 1;
    // Terms cosᵏ with coefficients 1, 2/3, 2·4/(3·5) … for odd ν and 1, 1/2, 1·3/(2·4) … for even ν.
    let (mut term, mut sum) = if odd { (cos, 0.0) } else { (1.0, 0.0) };
    let mut power = if odd { 1 } else { 0 };
    while power <= freedom.saturating_sub(2) && freedom > 1 {
        sum += term;
        power += 2;
        term *= cos * cos * f64::from(power - 1) / f64::from(power);
    }
    if odd { 2.0 / PI * (angle + sin * sum) } else { sin * sum }
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ContinuousCDF, StudentsT};

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (two_sided, freedom, expected) in [
            (0.05, 1, 12.706_205),
            (0.05, 2, 4.302_653),
            (0.05, 31, 2.039_513),
            (0.01, 7, 3.499_483),
            (0.05, 200, 1.971_896),
        ] {
            assert!((quantile(two_sided, freedom) - expected).abs() < 1e-6, "{freedom}");
        }
    }

    #[test]
    fn quantiles_invert_an_independent_distribution_function() {
        for freedom in [1, 2, 3, 4, 5, 8, 15, 31, 64, 127, 4095] {
            for two_sided in [0.5, 0.05, 0.001, 1e-5] {
                let other = StudentsT::new(0.0, 1.0, f64::from(freedom)).unwrap();
                let exceeded = 2.0 * (1.0 - other.cdf(quantile(two_sided, freedom)));
                assert!((exceeded / two_sided - 1.0).abs() < 1e-6, "{freedom} {two_sided}: {exceeded}");
            }
        }
    }
}
