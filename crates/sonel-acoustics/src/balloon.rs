//! Directivity balloon: energies over a regular grid of polar angle and azimuth, per band, with mean 1 over the sphere.
//!
//! Between nodes energy is linear in both angles. So it is never negative, continuous across cells, and its mean over the sphere is a
//! weighted sum over the nodes: the weight of a polar angle is ½ ∫ Λ(θ) sin θ dθ, Λ the hat function of its node. At both poles all azimuths
//! are one direction and hold their mean.
//!
//! Grid and levels as in [AES56] (docs/references.md).

use core::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::lanes::{BandValues, Lanes};

/// Largest difference between the mean of stored factors and 1: rounding of some hundred thousand nodes.
const MEAN_TOLERANCE: f64 = 1e-9;

/// Factors over directions, relative to an omnidirectional source of the same power.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Balloon {
    name: String,
    /// Azimuths 360° i / n from 0° on; one where all are alike.
    azimuths: usize,
    /// Polar angles 180° j / (n − 1).
    polars: usize,
    bands: usize,
    /// By azimuth, polar angle and band.
    factors: Vec<f64>,
}

/// Why energies are no balloon.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BalloonError {
    /// Less than one azimuth, two polar angles and one band, or another number of energies.
    #[error("the grid of directions does not fit its values")]
    Shape,
    /// A negative or infinite energy, or none at all.
    #[error("a value is negative or not a number")]
    Value,
    /// All energies of a band are 0.
    #[error("no direction has energy in band {0}, counted from 0")]
    Silent(usize),
    /// Stored factors whose mean is not 1.
    #[error("the mean over the sphere is not 1 in band {0}, counted from 0")]
    Mean(usize),
}

/// Factors of one direction.
#[derive(Clone, Copy, Debug)]
pub enum Radiation<'a> {
    /// The same in every band.
    Alike(f64),
    /// Per band, of the nodes around the direction with their weights.
    PerBand([(&'a [f64], f64); 4]),
}

impl Radiation<'_> {
    /// Factor in `band`; 0 behind the last.
    #[inline]
    #[must_use]
    pub fn factor(&self, band: usize) -> f64 {
        match self {
            Self::Alike(factor) => *factor,
            Self::PerBand(nodes) => {
                nodes.iter().map(|(factors, weight)| weight * factors.get(band).unwrap_or(&0.0)).sum()
            }
        }
    }

    /// Multiplies `energies` by their factors.
    #[inline]
    pub fn weigh(&self, energies: &mut [Lanes]) {
        for (band, energy) in energies.values_mut().enumerate() {
            *energy *= self.factor(band);
        }
    }
}

impl Balloon {
    /// A balloon of `energies` by azimuth, polar angle and band, whose numbers are `shape`. Each band may have a unit of its own.
    ///
    /// # Errors
    /// See [`BalloonError`].
    pub fn new(name: &str, shape: [usize; 3], energies: Vec<f64>) -> Result<Self, BalloonError> {
        let [azimuths, polars, bands] = shape;
        let mut balloon = Self { name: name.to_owned(), azimuths, polars, bands, factors: energies };
        balloon.check()?;
        for band in 0..bands {
            for pole in [0, polars - 1] {
                let mean = (0..azimuths).map(|i| balloon.node(i, pole)[band]).sum::<f64>() / azimuths as f64;
                (0..azimuths).for_each(|i| balloon.factors[(i * polars + pole) * bands + band] = mean);
            }
            let mean = balloon.mean(band);
            if mean <= 0.0 {
                return Err(BalloonError::Silent(band));
            }
            balloon.factors.iter_mut().skip(band).step_by(bands).for_each(|factor| *factor /= mean);
        }
        Ok(balloon)
    }

    /// A balloon of factors that were [`Self::factors`] of one.
    ///
    /// # Errors
    /// See [`BalloonError`].
    pub fn restored(name: String, shape: [usize; 3], factors: Vec<f64>) -> Result<Self, BalloonError> {
        let [azimuths, polars, bands] = shape;
        let balloon = Self { name, azimuths, polars, bands, factors };
        balloon.check()?;
        let off = |band: &usize| (balloon.mean(*band) - 1.0).abs() > MEAN_TOLERANCE;
        (0..bands).find(off).map_or(Ok(()), |band| Err(BalloonError::Mean(band)))?;
        Ok(balloon)
    }

    /// With all bands `times` times, one after the other.
    #[must_use]
    pub fn repeated(&self, times: usize) -> Self {
        let factors = self.factors.chunks_exact(self.bands).flat_map(|node| node.repeat(times)).collect();
        Self { bands: times * self.bands, factors, ..self.clone() }
    }

    fn check(&self) -> Result<(), BalloonError> {
        let count = self.azimuths.checked_mul(self.polars).and_then(|nodes| nodes.checked_mul(self.bands));
        if self.azimuths < 1 || self.polars < 2 || self.bands < 1 || count != Some(self.factors.len()) {
            return Err(BalloonError::Shape);
        }
        let is_energy = |energy: &f64| (0.0..f64::INFINITY).contains(energy);
        if self.factors.iter().all(is_energy) { Ok(()) } else { Err(BalloonError::Value) }
    }

    /// Name, such as that of its file.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Numbers of azimuths, polar angles and bands.
    #[must_use]
    pub fn shape(&self) -> [usize; 3] {
        [self.azimuths, self.polars, self.bands]
    }

    /// All factors, by azimuth, polar angle and band.
    #[must_use]
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }

    /// Factor on the axis in `band`: the directivity factor Q, whose level is the directivity index.
    #[must_use]
    pub fn on_axis(&self, band: usize) -> f64 {
        self.factors[band]
    }

    /// Largest factor of any direction in `band`.
    #[must_use]
    pub fn largest(&self, band: usize) -> f64 {
        self.factors.iter().skip(band).step_by(self.bands).copied().fold(0.0, f64::max)
    }

    /// Mean over the sphere in `band`.
    #[must_use]
    pub fn mean(&self, band: usize) -> f64 {
        let of_polar = |j: usize| (0..self.azimuths).map(|i| self.node(i, j)[band]).sum::<f64>();
        let sum: f64 = (0..self.polars).map(|j| self.polar_weight(j) * of_polar(j)).sum();
        sum / self.azimuths as f64
    }

    /// ½ ∫ Λ(θ) sin θ dθ of polar angle `j`.
    fn polar_weight(&self, j: usize) -> f64 {
        let step = PI / (self.polars - 1) as f64;
        let at = j as f64 * step;
        let slope = |from: f64, to: f64| (libm::sin(to) - libm::sin(from)) / step;
        let rising = if j == 0 { 0.0 } else { slope(at - step, at) - libm::cos(at) };
        let falling = if j + 1 == self.polars { 0.0 } else { libm::cos(at) - slope(at, at + step) };
        0.5 * (rising + falling)
    }

    fn node(&self, azimuth: usize, polar: usize) -> &[f64] {
        let at = (azimuth * self.polars + polar) * self.bands;
        &self.factors[at..at + self.bands]
    }

    /// Factors at `polar`, 0 … π, and `azimuth`, any angle [rad].
    #[must_use]
    pub fn at(&self, polar: f64, azimuth: f64) -> Radiation<'_> {
        let (row, down) = split(polar / PI * (self.polars - 1) as f64, self.polars - 2);
        let turns = azimuth / TAU;
        let (column, right) = split((turns - libm::floor(turns)) * self.azimuths as f64, self.azimuths - 1);
        let next = (column + 1) % self.azimuths;
        Radiation::PerBand([
            (self.node(column, row), (1.0 - right) * (1.0 - down)),
            (self.node(next, row), right * (1.0 - down)),
            (self.node(column, row + 1), (1.0 - right) * down),
            (self.node(next, row + 1), right * down),
        ])
    }
}

/// Number of the cell at `place`, at most `last`, and the share of it that is passed.
fn split(place: f64, last: usize) -> (usize, f64) {
    let cell = (place.max(0.0) as usize).min(last);
    (cell, (place - cell as f64).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Directivity, Pattern};
    use glam::{DVec3, dvec3};

    /// `energy` of polar angle and azimuth [rad] at nodes of `step` degrees, and 1 in a second band.
    fn sampled(step: usize, energy: impl Fn(f64, f64) -> f64) -> Balloon {
        let (azimuths, polars) = (360 / step, 180 / step + 1);
        let nodes = (0..azimuths).flat_map(|i| (0..polars).map(move |j| (i, j)));
        let angle = |node: usize| (node * step) as f64 / 180.0 * PI;
        let energies = nodes.flat_map(|(i, j)| [energy(angle(j), angle(i)), 1.0]).collect();
        Balloon::new("sampled", [azimuths, polars, 2], energies).unwrap()
    }

    fn cardioid(polar: f64, _: f64) -> f64 {
        0.25 * (1.0 + libm::cos(polar)) * (1.0 + libm::cos(polar))
    }

    /// A lopsided horn.
    fn horn(polar: f64, azimuth: f64) -> f64 {
        libm::exp(-3.0 * polar * (1.5 + libm::sin(azimuth)))
    }

    /// Mean over the sphere by Gauss' three points in parts of 2° of polar angle, and the midpoint rule in azimuth, which is exact for
    /// what is linear between nodes.
    fn quadrature(balloon: &Balloon) -> f64 {
        let (azimuths, part) = (2 * balloon.shape()[0], PI / 180.0);
        let gauss = [(-libm::sqrt(0.6), 5.0 / 9.0), (0.0, 8.0 / 9.0), (libm::sqrt(0.6), 5.0 / 9.0)];
        let mut sum = 0.0;
        for (row, (node, weight)) in (0..180).flat_map(|row| gauss.map(|gauss| (row, gauss))) {
            let polar = (f64::from(row) + 0.5 * (1.0 + node)) * part;
            for column in 0..azimuths {
                let azimuth = (column as f64 + 0.5) * TAU / azimuths as f64;
                sum += 0.5 * part * weight * libm::sin(polar) * balloon.at(polar, azimuth).factor(0);
            }
        }
        sum / (2 * azimuths) as f64
    }

    #[test]
    fn the_mean_over_the_sphere_is_one() {
        for energy in [cardioid, horn] {
            for step in [5, 10, 30, 90] {
                let balloon = sampled(step, energy);
                let mean = quadrature(&balloon);
                assert!((mean - 1.0).abs() < 1e-9, "{step}: {mean}");
                assert!((balloon.mean(0) - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_mean_over_nodes_without_weights_is_rejected() {
        let balloon = sampled(5, horn);
        let unweighted: f64 = balloon.factors().iter().step_by(2).sum::<f64>() / (72.0 * 37.0);
        assert!((unweighted - 1.0).abs() > 0.1, "{unweighted}");
    }

    #[test]
    fn a_sampled_cardioid_is_the_cardioid_within_the_interpolation_error() {
        let (aim, up) = (dvec3(0.0, 0.6, 0.8), dvec3(1.0, 0.0, 0.0));
        let measured = Directivity::Measured { balloon: sampled(5, cardioid), up };
        for direction in [aim, dvec3(0.48, 0.6, 0.64), dvec3(-0.8, 0.0, 0.6), -aim] {
            let exact = Directivity::from(Pattern::Cardioid).towards(aim, direction).factor(0);
            let found = measured.towards(aim, direction);
            // h² / 8 of the largest second derivative, 3, and as much of the norm.
            assert!((found.factor(0) - exact).abs() < 2.0 * 0.0873 * 0.0873 / 8.0 * 3.0, "{direction}");
            assert!((found.factor(1) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn azimuths_are_counted_from_the_right_upwards() {
        let lobe = |polar: f64, azimuth: f64| libm::sin(polar) * (1.0 + libm::cos(azimuth - PI / 2.0));
        let measured = |up| Directivity::Measured { balloon: sampled(10, lobe), up };
        let at = |up: DVec3, direction: DVec3| measured(up).towards(DVec3::Y, direction).factor(0);
        assert!(at(DVec3::Z, DVec3::Z) > 2.0 && at(DVec3::Z, DVec3::NEG_Z) < 1e-12);
        // Rolled to the right by a quarter, it points there.
        assert!(at(DVec3::X, DVec3::X) > 2.0 && at(DVec3::X, DVec3::Z) > 1.0 && at(DVec3::X, DVec3::Z) < 2.0);
        let right = |_: f64, azimuth: f64| 1.0 + libm::cos(azimuth);
        let balloon = sampled(10, right);
        let measured = Directivity::Measured { balloon, up: DVec3::Z };
        assert!((measured.towards(DVec3::Y, DVec3::X).factor(0) - 2.0).abs() < 1e-6);
    }

    #[test]
    fn factors_are_restored_bit_for_bit_and_others_are_refused() {
        let balloon = sampled(30, horn);
        let restored = |factors| Balloon::restored("sampled".to_owned(), balloon.shape(), factors);
        assert_eq!(restored(balloon.factors().to_vec()).unwrap(), balloon);
        let with = |at: usize, value: f64| {
            let mut factors = balloon.factors().to_vec();
            factors[at] = value;
            restored(factors).unwrap_err()
        };
        assert_eq!(with(10, -1.0), BalloonError::Value);
        assert_eq!(with(10, f64::NAN), BalloonError::Value);
        assert_eq!(with(11, 1.1), BalloonError::Mean(1));
        assert_eq!(restored(vec![1.0; 7]).unwrap_err(), BalloonError::Shape);
        assert_eq!(Balloon::new("", [1, 2, 2], vec![1.0, 0.0, 1.0, 0.0]), Err(BalloonError::Silent(1)));
    }
}
