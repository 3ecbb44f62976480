//! Energies by direction of arrival, for lateral fractions, the late lateral level and the mean direction of every bin.
//!
//! References: [ISO3382-1] annex A (docs/references.md).

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
    /// Energies, [S, R, B, T] as the response's [1/m²].
    pub energy: Vec<f64>,
    /// Energies per batch as in [`crate::Batches`], empty without batches.
    pub energy_batches: Vec<f32>,
    /// Kernel difference as in [`crate::Batches`].
    pub kernel_difference: Vec<f32>,
}

/// Names of the arrays of each [`Lateral`].
pub const LATERAL_KEYS: [[&str; 3]; 2] = [
    ["lateral_energy", "lateral_energy_batches", "lateral_kernel_difference_batches"],
    ["lateral_cross_energy", "lateral_cross_energy_batches", "lateral_cross_kernel_difference_batches"],
];
