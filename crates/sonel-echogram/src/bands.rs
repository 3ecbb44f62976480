//! Some of the bands of a response.

use std::ops::Range;

use crate::directions::{Directions, Lateral};
use crate::response::{Arrivals, Batches, Missing, Response};

impl Response {
    /// The response in the bands of `range` alone; its metadata are empty.
    ///
    /// # Panics
    /// When it has no such bands.
    #[must_use]
    pub fn of_bands(&self, range: Range<usize>) -> Self {
        assert!(range.start < range.end && range.end <= self.bands(), "bands of the response");
        let bands = self.bands();
        let some = |values: &[f64]| part(values, bands, values.len() / self.rows(), &range);
        let energy = |values: &[f64]| part(values, bands, self.bins(), &range);
        let coarse_bins = self.batches.as_ref().map_or(0, |batches| batches.bins);
        let coarse = |values: &[f32]| part(values, bands, coarse_bins, &range);
        let by_source = |values: &[f64]| part(values, bands, 1, &range);
        Self {
            center_frequency_hz: self.center_frequency_hz[range.clone()].to_vec(),
            time_edges_s: self.time_edges_s.clone(),
            receiver_names: self.receiver_names.clone(),
            receiver_positions: self.receiver_positions.clone(),
            receiver_directivities: self.receiver_directivities.clone(),
            source_names: self.source_names.clone(),
            source_positions: self.source_positions.clone(),
            source_power_level_db: by_source(&self.source_power_level_db),
            speed_of_sound: self.speed_of_sound,
            characteristic_impedance: self.characteristic_impedance,
            direct_times_s: self.direct_times_s.clone(),
            energy: energy(&self.energy),
            batches: self.batches.as_ref().map(|batches| Batches {
                weight: batches.weight.clone(),
                time_edges_s: batches.time_edges_s.clone(),
                bins: batches.bins,
                energy: coarse(&batches.energy),
                kernel_difference: coarse(&batches.kernel_difference),
            }),
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
                moment: some(&directions.moment),
            }),
            metadata: serde_json::Value::Null,
        }
    }

    /// S · R · B.
    fn rows(&self) -> usize {
        self.sources() * self.receivers() * self.bands()
    }
}

/// The bands of `range` of an array [outer, `bands`, `inner`].
fn part<T: Copy>(values: &[T], bands: usize, inner: usize, range: &Range<usize>) -> Vec<T> {
    let rows = values.chunks_exact((bands * inner).max(1));
    rows.flat_map(|row| &row[range.start * inner..range.end * inner]).copied().collect()
}
