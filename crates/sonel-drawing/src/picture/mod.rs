//! Pictures of energy on surfaces: [`exr`](exr()) writes every value for programs, [`png`](png()) draws one band.
//!
//! A value is the energy that arrived per area in a window of time, per unit energy that the source emits in the band [1/m²].
//! docs/formats/image.md describes both files.

mod exr;
mod png;

use serde_json::Value;

pub use exr::exr;
pub use png::{DecibelScale, Drawing, png};

/// Energy on surfaces as a camera sees it. Pixels are in rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Nominal centre of each band [Hz].
    pub center_frequencies_hz: Vec<f64>,
    /// Whether a pixel shows a surface.
    pub is_covered: Vec<bool>,
    /// By window of time.
    pub windows: Vec<WindowPicture>,
    /// What was asked for, for the files.
    pub metadata: Value,
}

/// The energy of one window of time.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowPicture {
    /// Such as `20-50ms`.
    pub name: String,
    /// By band and pixel [1/m²].
    pub energy: Vec<Vec<f32>>,
    /// Relative standard error of the sum over bands by pixel.
    pub relative_error: Vec<f32>,
}

impl Picture {
    /// The mean over bands with `weights`, per unit of what they emit together, by window and pixel [1/m²].
    #[must_use]
    pub fn weighted(&self, weights: &[f64]) -> Vec<Vec<f64>> {
        let total: f64 = weights.iter().sum();
        let of_pixel = |window: &WindowPicture, pixel: usize| -> f64 {
            let bands = window.energy.iter().zip(weights);
            bands.map(|(energy, weight)| f64::from(energy[pixel]) * weight).sum::<f64>() / total
        };
        let pixels = self.is_covered.len();
        self.windows.iter().map(|window| (0..pixels).map(|pixel| of_pixel(window, pixel)).collect()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_weighted_by_what_they_emit() {
        let window = WindowPicture {
            name: "all".to_owned(),
            energy: vec![vec![1.0, 0.0], vec![4.0, 2.0]],
            relative_error: vec![0.0; 2],
        };
        let picture = Picture {
            size: [2, 1],
            center_frequencies_hz: vec![125.0, 250.0],
            is_covered: vec![true; 2],
            windows: vec![window],
            metadata: Value::Null,
        };
        assert_eq!(picture.weighted(&[1.0, 1.0]), [[2.5, 1.0]]);
        assert_eq!(picture.weighted(&[1.0, 0.0]), [[1.0, 0.0]]);
    }
}
