//! What kernels of half the area would have found: the measure of their bias.
//!
//! A disc or a sphere of radius h averages over its area, with a bias of O(h²): over half the area the same sonels say
//! how much (docs/physics.md §7). With E from the whole and E′ from half the area the bias of E is 2 (E − E′) up to
//! O(h⁴). Here the difference E′ − E is added up per batch, in the coarse bins of the batches.

use std::iter::repeat_n;

use sonel_map::Lanes;

use crate::deposit::TimeBins;
use crate::rendering::CoarseEchogram;

/// E′ − E at the receivers of one sweep.
#[derive(Debug, Clone)]
pub(crate) struct KernelDifference {
    /// By receiver and column.
    pub at: Vec<CoarseEchogram>,
}

impl KernelDifference {
    /// Nothing yet, between the coarse `borders` of each receiver, in so many columns each.
    #[must_use]
    pub(crate) fn new(borders: &[Vec<f64>], columns: usize, bands: usize) -> Self {
        let empty = |borders: &Vec<f64>| repeat_n(CoarseEchogram::new(borders.len(), bands), columns);
        Self { at: borders.iter().flat_map(empty).collect() }
    }

    /// Adds how much `more` half the area makes of `energy` that the whole kernel found: once as much if the sonel lies in it too, less all of
    /// it if not; weighed as the column has it.
    #[inline]
    pub(crate) fn add(&mut self, column: usize, coarse: usize, energy: &[Lanes], more: f64) {
        self.at[column].add_share(coarse, energy, more);
    }
}

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

    #[test]
    fn a_sonel_in_the_inner_half_gains_what_one_in_the_outer_loses() {
        let mut difference = KernelDifference::new(&[vec![0.0, 1.0]], 1, 1);
        difference.add(0, 0, &sonel_map::to_lanes([3.0]), 1.0);
        difference.add(0, 0, &sonel_map::to_lanes([3.0]), -1.0);
        assert_eq!(difference.at[0].band(0).collect::<Vec<_>>(), [0.0]);
    }
}
