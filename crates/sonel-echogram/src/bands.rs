//! Some of the bands of a response.

use std::ops::Range;

use crate::directions::{Directions, Lateral};
use crate::response::{Arrivals, Missing, Response};

impl Response {
    /// The response in the bands of `range` alone; its provenance is empty.
    ///
    /// # Panics
    /// When it has no such bands.
    #[must_use]
    pub fn of_bands(&self, range: Range<usize>) -> Self {
        assert!(range.start < range.end && range.end <= self.bands(), "bands of the response");
        let bands = self.bands();
        let by_source = |values: &[f64]| part(values, bands, 1, &range);
        let energy = |values: &[f64]| part(values, bands, self.bins(), &range);
        let coarse_bins = self.batches.as_ref().map_or(0, |batches| batches.bins);
        let coarse = |values: &[f32]| part(values, bands, coarse_bins, &range);
        Self {
            center_frequency_hz: self.center_frequency_hz[range.clone()].to_vec(),
            source_power_level_db: by_source(&self.source_power_level_db),
            energy: energy(&self.energy),
            batches: self
                .batches
                .as_ref()
                .map(|batches| batches.with(coarse(&batches.energy), coarse(&batches.kernel_difference))),
            missing: self.missing.as_ref().map(|missing| Missing {
                fluence: by_source(&missing.fluence),
                decay_rate: by_source(&missing.decay_rate),
            }),
            arrivals: Arrivals { energy: by_source(&self.arrivals.energy), ..self.arrivals.clone() },
            directions: self.directions.as_ref().map(|directions| Directions {
                lateral_axes: directions.lateral_axes.clone(),
                lateral: directions.lateral.each_ref().map(|lateral| Lateral {
                    energy: energy(&lateral.energy),
                    energy_batches: coarse(&lateral.energy_batches),
                    kernel_difference: coarse(&lateral.kernel_difference),
                }),
                moment: part(&directions.moment, bands, 3 * self.bins(), &range),
            }),
            ..self.silent()
        }
    }
}

/// The bands of `range` of an array [outer, `bands`, `inner`].
fn part<T: Copy>(values: &[T], bands: usize, inner: usize, range: &Range<usize>) -> Vec<T> {
    let rows = values.chunks_exact((bands * inner).max(1));
    rows.flat_map(|row| &row[range.start * inner..range.end * inner]).copied().collect()
}
