//! Choice among weighted items in constant time.
//!
//! Reference: [Vose1991] (docs/references.md).

/// Constant-time choice among weighted items from one uniform number.
#[derive(Debug)]
pub(super) struct AliasTable {
    threshold: Vec<f64>,
    alias: Vec<u32>,
}

impl AliasTable {
    /// Items with these `weights`, not all of them zero.
    #[must_use]
    pub(super) fn new(weights: &[f64]) -> Self {
        let scale = weights.len() as f64 / weights.iter().sum::<f64>();
        let mut threshold: Vec<f64> = weights.iter().map(|weight| weight * scale).collect();
        let mut alias: Vec<u32> = (0..weights.len() as u32).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) =
            (0..weights.len()).partition(|&item| threshold[item] < 1.0);
        while let (Some(&poor), Some(&rich)) = (small.last(), large.last()) {
            small.pop();
            alias[poor] = rich as u32;
            threshold[rich] -= 1.0 - threshold[poor];
            if threshold[rich] < 1.0 {
                large.pop();
                small.push(rich);
            }
        }
        // What remains is full but for rounding.
        for item in small.into_iter().chain(large) {
            threshold[item] = 1.0;
        }
        Self { threshold, alias }
    }

    /// The item for the uniform number `u` in [0, 1).
    #[inline]
    #[must_use]
    pub(super) fn choose(&self, u: f64) -> usize {
        let scaled = u * self.threshold.len() as f64;
        let item = (scaled as usize).min(self.threshold.len() - 1);
        if scaled - (item as f64) < self.threshold[item] { item } else { self.alias[item] as usize }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The exact probability of every item, by measuring the intervals of `u` that choose it.
    fn probabilities(weights: &[f64]) -> Vec<f64> {
        let table = AliasTable::new(weights);
        let steps = 1_000_000;
        let mut counts = vec![0.0; weights.len()];
        for step in 0..steps {
            counts[table.choose((f64::from(step) + 0.5) / f64::from(steps))] += 1.0 / f64::from(steps);
        }
        counts
    }

    #[test]
    fn items_are_chosen_in_proportion_to_their_weights() {
        let weights = [5.0, 0.0, 1.0, 0.25, 3.75];
        for (found, weight) in probabilities(&weights).iter().zip(weights) {
            assert!((found - weight / 10.0).abs() < 1e-5);
        }
    }

    #[test]
    fn one_item_is_always_chosen() {
        assert_eq!(probabilities(&[0.3]).len(), 1);
    }
}
