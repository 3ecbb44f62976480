//! Chi-square goodness of fit, and tests of samplers on the square, the sphere and the hemisphere.
//!
//! [`goodness_of_fit`] compares counts with the probabilities of their cells; cells that expect fewer than five
//! counts are pooled, as the distribution of the statistic holds only beyond that. [`square`], [`sphere`] and
//! [`hemisphere`] draw from a sampler, bin what it returns in cells of equal area, integrate the density it claims
//! over each cell, and repeat with fresh numbers; the level of significance is shared by the runs (Šidák).
//!
//! Three flaws are rejected outright, whatever the statistic: a density that does not integrate to one, a sample
//! where the density is zero, and a sample outside of the domain.
//!
//! Reference: [Pearson1900]; the manner is that of the sampler tests of the Mitsuba 3 renderer.

mod domain;
mod verdict;

pub use domain::{Plan, hemisphere, sphere, square};
pub use verdict::{Flaw, Verdict};

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Fewest expected counts of a cell that stands alone.
const THIN_CELL: f64 = 5.0;
/// How far the probabilities of all cells may be from one in sum. Wide enough for the quadrature of a density with
/// a jump inside a cell, and of no account to the statistic, which is taken with normalised probabilities.
const MASS_TOLERANCE: f64 = 1e-3;

/// Outcome of one comparison of counts with their expectation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Σ (observed − expected)² / expected over the cells after pooling.
    pub statistic: f64,
    /// Cells after pooling, less one.
    pub degrees_of_freedom: usize,
    /// Probability of a statistic at least that large if the expectation is true.
    pub p_value: f64,
    /// How many cells were too thin to stand alone.
    pub pooled_cells: usize,
}

/// Compares `observed` counts with the `probabilities` of the cells (non-negative, sum 1).
///
/// # Errors
/// The [`Flaw`] when the probabilities are none, when a cell of probability zero was hit, or when pooling leaves
/// fewer than two cells, so that nothing could be rejected.
pub fn goodness_of_fit(observed: &[u64], probabilities: &[f64]) -> Result<Fit, Flaw> {
    assert_eq!(observed.len(), probabilities.len(), "counts and probabilities describe the same cells");
    let mass = probabilities.iter().sum::<f64>();
    if probabilities.iter().any(|&p| p.is_nan() || p < 0.0) || (mass - 1.0).abs() > MASS_TOLERANCE {
        return Err(Flaw::NotNormalised { mass });
    }
    if let Some(cell) = (0..observed.len()).find(|&i| observed[i] > 0 && probabilities[i] <= 0.0) {
        return Err(Flaw::Impossible { cell, count: observed[cell] });
    }
    let total = observed.iter().sum::<u64>() as f64;
    let expected = probabilities.iter().map(|p| p / mass * total).collect::<Vec<_>>();
    let (cells, pooled_cells) = pool(observed, &expected);
    if cells.len() < 2 {
        return Err(Flaw::TooFewCounts { cells: cells.len() });
    }
    let statistic = cells.iter().map(|(o, e)| (o - e) * (o - e) / e).sum::<f64>();
    let degrees_of_freedom = cells.len() - 1;
    let p_value = ChiSquared::new(degrees_of_freedom as f64).map_or(0.0, |chi| chi.sf(statistic));
    Ok(Fit { statistic, degrees_of_freedom, p_value, pooled_cells })
}

/// Observed and expected counts with the thin cells gathered, thinnest first, until each pool is thick enough;
/// and how many were gathered.
fn pool(observed: &[u64], expected: &[f64]) -> (Vec<(f64, f64)>, usize) {
    let mut order = (0..expected.len()).filter(|&i| expected[i] > 0.0).collect::<Vec<_>>();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let mut cells = Vec::new();
    let (mut gathered, mut pooled) = ((0.0, 0.0), 0);
    for i in order {
        let thin = expected[i] < THIN_CELL;
        pooled += usize::from(thin);
        gathered = (gathered.0 + observed[i] as f64, gathered.1 + expected[i]);
        // The last thin pool, if too thin itself, takes the thinnest of the thick cells along.
        if gathered.1 >= THIN_CELL {
            cells.push(std::mem::take(&mut gathered));
        }
    }
    if gathered.1 > 0.0 {
        match cells.last_mut() {
            Some(last) => *last = (last.0 + gathered.0, last.1 + gathered.1),
            None => cells.push(gathered),
        }
    }
    (cells, pooled)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uniform::Uniform;

    fn counts(probabilities: &[f64], total: usize, seed: u64) -> Vec<u64> {
        let mut numbers = Uniform::new(seed);
        let mut counts = vec![0; probabilities.len()];
        for _ in 0..total {
            let mut left = numbers.next_f64();
            let cell = probabilities.iter().position(|p| {
                left -= p;
                left < 0.0
            });
            counts[cell.unwrap_or(probabilities.len() - 1)] += 1;
        }
        counts
    }

    #[test]
    fn a_textbook_table() {
        // A die thrown 60 times.
        let fit = goodness_of_fit(&[5, 8, 12, 9, 13, 13], &[1.0 / 6.0; 6]).unwrap();
        assert!((fit.statistic - (25.0 + 4.0 + 4.0 + 1.0 + 9.0 + 9.0) / 10.0).abs() < 1e-12);
        assert_eq!(fit.degrees_of_freedom, 5);
        // Upper tail for odd degrees of freedom: erfc(√(x/2)) + √(2x/π) e^(−x/2) (1 + x/3), at x = 5.2.
        assert!((fit.p_value - 0.391_962).abs() < 2e-5, "{}", fit.p_value);
    }

    #[test]
    fn p_values_of_a_true_expectation_are_uniform_even_with_thin_cells() {
        let probabilities = [0.5, 0.3, 0.1, 0.05, 0.02, 0.01, 0.008, 0.007, 0.003, 0.002];
        let mut deciles = [0_u64; 10];
        for seed in 0..2000 {
            let fit = goodness_of_fit(&counts(&probabilities, 1000, seed), &probabilities).unwrap();
            assert_eq!(fit.pooled_cells, 2);
            deciles[((fit.p_value * 10.0) as usize).min(9)] += 1;
        }
        let fit = goodness_of_fit(&deciles, &[0.1; 10]).unwrap();
        assert!(fit.p_value > 1e-3, "{deciles:?}");
    }

    #[test]
    fn a_wrong_expectation_is_rejected() {
        let observed = counts(&[0.3, 0.3, 0.4], 10_000, 1);
        assert!(goodness_of_fit(&observed, &[0.3, 0.3, 0.4]).unwrap().p_value > 1e-3);
        assert!(goodness_of_fit(&observed, &[0.33, 0.3, 0.37]).unwrap().p_value < 1e-6);
    }

    #[test]
    fn flaws_that_no_statistic_shows_are_named() {
        let flaw =
            |observed: &[u64], probabilities: &[f64]| goodness_of_fit(observed, probabilities).unwrap_err();
        assert!(matches!(flaw(&[50, 50], &[0.5, 0.6]), Flaw::NotNormalised { .. }));
        assert!(matches!(flaw(&[50, 50], &[f64::NAN, 0.5]), Flaw::NotNormalised { .. }));
        assert!(matches!(flaw(&[50, 50], &[1.5, -0.5]), Flaw::NotNormalised { .. }));
        assert_eq!(flaw(&[50, 1, 50], &[0.5, 0.0, 0.5]), Flaw::Impossible { cell: 1, count: 1 });
        assert!(matches!(flaw(&[3, 3], &[0.5, 0.5]), Flaw::TooFewCounts { .. }));
        assert!(matches!(flaw(&[0, 0], &[0.5, 0.5]), Flaw::TooFewCounts { .. }));
    }

    #[test]
    fn pooling_keeps_every_count() {
        let expected = [0.5, 7.0, 1.0, 3.0, 0.2, 20.0, 0.0];
        let observed = [1, 5, 0, 4, 1, 21, 0];
        let (cells, pooled) = pool(&observed, &expected);
        assert_eq!(pooled, 4);
        assert!(cells.iter().all(|cell| cell.1 >= THIN_CELL));
        let sums = cells.iter().fold((0.0, 0.0), |sum, cell| (sum.0 + cell.0, sum.1 + cell.1));
        assert!((sums.0 - 32.0).abs() < 1e-12 && (sums.1 - 31.7).abs() < 1e-12);
    }
}
