//! Directivity of sources: first-order energy patterns about an aim.
//!
//! Pressure goes as a + (1−a) cos θ, energy as its square, scaled to mean 1 over the sphere: the source power is then
//! the same whatever the pattern. The same in every band.
//!
//! Reference: [Eargle2004] on first-order patterns (docs/references.md).

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A pattern about the source's aim.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Directivity {
    /// The same in every direction, a = 1.
    #[default]
    Omni,
    /// a = 0.7.
    Subcardioid,
    /// a = 1/2: nothing backwards.
    Cardioid,
    /// a = (√3−1)/2: largest front-to-back ratio of energies.
    Supercardioid,
    /// a = 1/4: largest directivity factor, 4.
    Hypercardioid,
    /// a = 0: a dipole.
    FigureEight,
}

/// A word that names no [`Directivity`].
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "unknown directivity `{0}`: one of omni, subcardioid, cardioid, supercardioid, hypercardioid, figure-eight"
)]
pub struct UnknownDirectivity(pub String);

impl Directivity {
    /// Every pattern, omnidirectional first.
    pub const ALL: [Self; 6] = [
        Self::Omni,
        Self::Subcardioid,
        Self::Cardioid,
        Self::Supercardioid,
        Self::Hypercardioid,
        Self::FigureEight,
    ];

    /// Lower-case kebab name, as in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Omni => "omni",
            Self::Subcardioid => "subcardioid",
            Self::Cardioid => "cardioid",
            Self::Supercardioid => "supercardioid",
            Self::Hypercardioid => "hypercardioid",
            Self::FigureEight => "figure-eight",
        }
    }

    /// The omnidirectional share a of the pressure pattern a + (1−a) cos θ.
    fn omnidirectional_share(self) -> f64 {
        match self {
            Self::Omni => 1.0,
            Self::Subcardioid => 0.7,
            Self::Cardioid => 0.5,
            Self::Supercardioid => (libm::sqrt(3.0) - 1.0) / 2.0,
            Self::Hypercardioid => 0.25,
            Self::FigureEight => 0.0,
        }
    }

    /// Energy radiated at the angle θ from the aim, relative to an omnidirectional source of the same power;
    /// `cos_angle` = cos θ, −1 … 1. Mean 1 over the sphere.
    pub fn factor(self, cos_angle: f64) -> f64 {
        let share = self.omnidirectional_share();
        let gradient = 1.0 - share;
        let pressure = share + gradient * cos_angle;
        pressure * pressure / (share * share + gradient * gradient / 3.0)
    }
}

impl std::fmt::Display for Directivity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Directivity {
    type Err = UnknownDirectivity;

    fn from_str(name: &str) -> Result<Self, UnknownDirectivity> {
        let found = Self::ALL.into_iter().find(|directivity| directivity.name() == name);
        found.ok_or_else(|| UnknownDirectivity(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean over the sphere by two-point Gauss quadrature in cos θ, exact for the square of a first-order pattern.
    fn sphere_mean(factor: impl Fn(f64) -> f64) -> f64 {
        let node = 1.0 / 3f64.sqrt();
        f64::midpoint(factor(-node), factor(node))
    }

    #[test]
    fn mean_over_the_sphere_is_one() {
        for directivity in Directivity::ALL {
            let mean = sphere_mean(|cos_angle| directivity.factor(cos_angle));
            assert!((mean - 1.0).abs() < 1e-14, "{directivity}: {mean}");
        }
    }

    #[test]
    fn an_unscaled_pattern_is_rejected() {
        let mean = sphere_mean(|cos_angle| (0.5 + 0.5 * cos_angle).powi(2));
        assert!((mean - 1.0).abs() > 0.5);
    }

    #[test]
    fn characteristic_values() {
        assert!((Directivity::Cardioid.factor(1.0) - 3.0).abs() < 1e-14);
        assert!(Directivity::Cardioid.factor(-1.0).abs() < 1e-14);
        assert!((Directivity::Hypercardioid.factor(1.0) - 4.0).abs() < 1e-14);
        assert!(Directivity::FigureEight.factor(0.0).abs() < 1e-14);
        assert!((Directivity::Supercardioid.factor(1.0) - 3.732).abs() < 1e-3);
    }

    #[test]
    fn names_round_trip() {
        for directivity in Directivity::ALL {
            assert_eq!(directivity.to_string().parse(), Ok(directivity));
        }
        assert!("Omni".parse::<Directivity>().is_err());
    }
}
