//! What a test of a sampler returns.

use std::fmt;

use thiserror::Error;

use crate::significance::sidak;

/// Why a sampler and its density are rejected without looking at the statistic.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Flaw {
    /// The density is negative or NaN somewhere, or does not integrate to one.
    #[error("the density integrates to {mass}, not to 1, or is negative or NaN somewhere")]
    NotNormalised {
        /// The integral over the domain.
        mass: f64,
    },
    /// A cell of probability zero was hit.
    #[error("cell {cell} has probability 0 but was hit {count} times")]
    Impossible {
        /// Index of the cell.
        cell: usize,
        /// How often it was hit.
        count: u64,
    },
    /// Too few counts for a statistic.
    #[error("only {cells} cells are left after pooling: take more samples or fewer cells")]
    TooFewCounts {
        /// Cells left.
        cells: usize,
    },
    /// A sample lies outside of the domain, is no unit vector, or is NaN.
    #[error("the sampler returned {sample:?}, which is outside of the domain")]
    Outside {
        /// The sample; unused components are zero.
        sample: [f64; 3],
    },
}

/// The outcome of a test of a sampler.
#[must_use = "a verdict that nobody reads is no test"]
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// p-value of each run; empty when a flaw was found.
    pub p_values: Vec<f64>,
    /// Level of significance of all runs together.
    pub significance: f64,
    /// What was wrong beyond any statistic.
    pub flaw: Option<Flaw>,
}

impl Verdict {
    /// Whether the sampler passes: no flaw, and no p-value below the level each run has by Šidák.
    pub fn accepted(&self) -> bool {
        self.flaw.is_none() && !self.p_values.is_empty() && self.smallest() >= self.each()
    }

    fn smallest(&self) -> f64 {
        self.p_values.iter().copied().fold(1.0, f64::min)
    }

    fn each(&self) -> f64 {
        sidak(self.significance, self.p_values.len().max(1))
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.flaw {
            Some(flaw) => write!(f, "rejected: {flaw}"),
            None => {
                let word = if self.accepted() { "accepted" } else { "rejected" };
                write!(f, "{word}: p-values {:?}, each judged at {:.2e}", self.p_values, self.each())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_small_p_value_rejects_and_none_at_all_too() {
        let verdict =
            |p_values: &[f64]| Verdict { p_values: p_values.to_vec(), significance: 0.01, flaw: None };
        assert!(verdict(&[0.5, 0.0021, 0.9, 0.3, 0.2]).accepted());
        assert!(!verdict(&[0.5, 0.0019, 0.9, 0.3, 0.2]).accepted());
        assert!(!verdict(&[]).accepted());
        let flawed = Verdict { flaw: Some(Flaw::TooFewCounts { cells: 1 }), ..verdict(&[0.5]) };
        assert!(!flawed.accepted());
        assert!(flawed.to_string().starts_with("rejected"));
    }
}
