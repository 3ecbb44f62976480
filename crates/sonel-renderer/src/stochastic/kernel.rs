//! What kernels of half the area would have found: the measure of their bias.
//!
//! A disc or a sphere of radius h averages over its area, with a bias of O(h²): over half the area the same sonels say
//! how much (docs/physics.md §7). With E from the whole and E′ from half the area the bias of E is 2 (E − E′) up to
//! O(h⁴). Here the difference E′ − E is added up per batch, in the coarse bins of the batches.

use crate::deposit::TimeBins;

/// The coarse bin of every fine bin, by their middles.
#[must_use]
pub(crate) fn coarse_bins(borders: &[f64], bins: &TimeBins) -> Vec<u32> {
    let last = borders.len() as u32 - 2;
    let mut coarse = 0;
    (0..bins.count)
        .map(|bin| {
            let middle = (bin as f64 + 0.5) * bins.width;
            while coarse < last && borders[coarse as usize + 1] <= middle {
                coarse += 1;
            }
            coarse
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fine_bins_belong_where_their_middles_are() {
        let bins = TimeBins::new(0.01, 0.05, 343.0);
        assert_eq!(coarse_bins(&[0.0, 0.016, 0.03], &bins), [0, 0, 1, 1, 1]);
        assert_eq!(coarse_bins(&[0.0, 0.004], &bins), [0; 5]);
    }
}
