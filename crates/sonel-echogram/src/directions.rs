//! Energies by direction of arrival: what lateral fractions and the late lateral level are read from, and the mean direction of every bin.
//!
//! References: [ISO3382-1] annex A (docs/references.md).

use crate::{Arrivals, Batches, Missing, Response};

/// Energies by direction, beside the energy of a response.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    /// Lateral axis of every receiver, a unit vector. [R]
    pub lateral_axes: Vec<[f64; 3]>,
    /// Energies times cos² and times |cos| of the angle between their direction and the lateral axis, in the order of [`LATERAL_KEYS`].
    pub lateral: [Lateral; 2],
    /// Energy times the unit vector towards where it comes from, [S, R, B, T, 3] [1/m²].
    pub moment: Vec<f64>,
}

/// Energy weighed by the angle to the lateral axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lateral {
    /// As the response's, [S, R, B, T] [1/m²].
    pub energy: Vec<f64>,
    /// As that of [`Batches`], empty without batches.
    pub energy_batches: Vec<f32>,
    /// As that of [`Batches`].
    pub kernel_difference: Vec<f32>,
}

/// Names of the arrays of each [`Lateral`].
pub const LATERAL_KEYS: [[&str; 3]; 2] = [
    ["lateral_energy", "lateral_energy_batches", "lateral_kernel_difference_batches"],
    ["lateral_cross_energy", "lateral_cross_energy_batches", "lateral_cross_kernel_difference_batches"],
];

/// Means of cos² and of |cos| over all directions.
const DIFFUSE_SHARE: [f64; 2] = [1.0 / 3.0, 0.5];

impl Response {
    /// The response with one of its lateral energies in place of the energy, without arrivals: what follows the last bin is expected to come from
    /// all directions. [`None`] without directions.
    #[must_use]
    pub fn lateral(&self, which: usize) -> Option<Self> {
        let Lateral { energy, energy_batches, kernel_difference } =
            self.directions.as_ref()?.lateral[which].clone();
        let batches = self.batches.as_ref().map(|Batches { weight, time_edges_s, bins, .. }| Batches {
            weight: weight.clone(),
            time_edges_s: time_edges_s.clone(),
            bins: *bins,
            energy: energy_batches,
            kernel_difference,
        });
        let missing = self.missing.as_ref().map(|Missing { fluence, decay_rate }| Missing {
            fluence: fluence.iter().map(|fluence| fluence * DIFFUSE_SHARE[which]).collect(),
            decay_rate: decay_rate.clone(),
        });
        Some(Self {
            center_frequency_hz: self.center_frequency_hz.clone(),
            time_edges_s: self.time_edges_s.clone(),
            receiver_names: self.receiver_names.clone(),
            receiver_positions: self.receiver_positions.clone(),
            receiver_directivities: Vec::new(),
            source_names: self.source_names.clone(),
            source_positions: self.source_positions.clone(),
            source_power_level_db: self.source_power_level_db.clone(),
            speed_of_sound: self.speed_of_sound,
            characteristic_impedance: self.characteristic_impedance,
            direct_times_s: self.direct_times_s.clone(),
            energy,
            batches,
            missing,
            arrivals: Arrivals::default(),
            directions: None,
            metadata: serde_json::Value::Null,
        })
    }
}
