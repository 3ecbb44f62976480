//! Directivity of sources and receivers: first-order patterns about an aim, and measured [balloons](Balloon).
//!
//! In a pattern pressure goes as a + (1−a) cos θ, energy as its square, the same in every band. The factor of a source has mean 1 over the
//! sphere: its power is the same whatever the directivity. The sensitivity of a receiver is 1 on its axis.
//!
//! Reference: [Eargle2004] on first-order patterns (docs/references.md).

use glam::DVec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::balloon::{Balloon, Radiation};

/// Sine of the angle up to which directions are parallel: what six written digits tell.
const PARALLEL: f64 = 1e-6;

/// Radiation of a source over directions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Directivity {
    /// A first-order pattern about the aim.
    Pattern(Pattern),
    /// A balloon about the aim, from which azimuths are counted towards `up`.
    Measured {
        /// Factors over directions.
        balloon: Balloon,
        /// Unit vector at right angles to the aim.
        up: DVec3,
    },
}

/// A first-order pattern.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
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
    "unknown directivity `{0}`: one of omni, subcardioid, cardioid, supercardioid, hypercardioid, figure-eight; of sources also talker"
)]
pub struct UnknownDirectivity(pub String);

impl From<Pattern> for Directivity {
    fn from(pattern: Pattern) -> Self {
        Self::Pattern(pattern)
    }
}

impl Directivity {
    /// The same in every direction.
    pub const OMNI: Self = Self::Pattern(Pattern::Omni);

    /// A balloon on a source that aims along the unit vector `aim`, with azimuths counted towards `up`; [`None`] where these are parallel and
    /// azimuths differ.
    #[must_use]
    pub fn measured(balloon: Balloon, aim: DVec3, up: DVec3) -> Option<Self> {
        let across = up - aim * up.dot(aim);
        let is_parallel = across.length() <= PARALLEL * up.length();
        let up = match is_parallel {
            true if balloon.shape()[0] > 1 => return None,
            true => aim.any_orthonormal_vector(),
            // Twice, since a small difference is at right angles to the aim only nearly.
            false => {
                let across = across.normalize();
                (across - aim * across.dot(aim)).normalize()
            }
        };
        Some(Self::Measured { balloon, up })
    }

    /// Whether it is the same in every direction.
    #[must_use]
    pub fn is_omni(&self) -> bool {
        *self == Self::OMNI
    }

    /// Whether it differs between bands.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        matches!(self, Self::Measured { .. })
    }

    /// The pattern's name, or that of the balloon.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Pattern(pattern) => pattern.name(),
            Self::Measured { balloon, .. } => balloon.name(),
        }
    }

    /// Energy radiated in the unit `direction` by a source with the unit vector `aim`, relative to an omnidirectional one of the same power.
    #[must_use]
    pub fn towards(&self, aim: DVec3, direction: DVec3) -> Radiation<'_> {
        match self {
            Self::Pattern(pattern) => Radiation::Alike(pattern.factor(aim.dot(direction).clamp(-1.0, 1.0))),
            Self::Measured { balloon, up } => {
                let (ahead, above) = (direction.dot(aim), direction.dot(*up));
                let aside = direction.dot(aim.cross(*up));
                balloon.at(libm::atan2(libm::hypot(aside, above), ahead), libm::atan2(above, aside))
            }
        }
    }
}

impl Pattern {
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

    /// Energy that a receiver takes from the angle θ off its aim, relative to its axis; `cos_angle` = cos θ, −1 … 1. Its mean over the
    /// sphere is 1/[`Self::factor`]`(1)`: 1/3 for a cardioid.
    #[must_use]
    pub fn sensitivity(self, cos_angle: f64) -> f64 {
        let pressure = self.pressure(cos_angle);
        pressure * pressure
    }

    /// Pressure of a receiver for sound from the angle θ off its aim, relative to its axis, a + (1−a) cos θ: negative behind a figure of eight.
    #[must_use]
    pub fn pressure(self, cos_angle: f64) -> f64 {
        let share = self.omnidirectional_share();
        share + (1.0 - share) * cos_angle
    }
}

impl std::fmt::Display for Pattern {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Pattern {
    type Err = UnknownDirectivity;

    fn from_str(name: &str) -> Result<Self, UnknownDirectivity> {
        let found = Self::ALL.into_iter().find(|pattern| pattern.name() == name);
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
        for pattern in Pattern::ALL {
            let mean = sphere_mean(|cos_angle| pattern.factor(cos_angle));
            assert!((mean - 1.0).abs() < 1e-14, "{pattern}: {mean}");
        }
    }

    #[test]
    fn an_unscaled_pattern_is_rejected() {
        let mean = sphere_mean(|cos_angle| (0.5 + 0.5 * cos_angle).powi(2));
        assert!((mean - 1.0).abs() > 0.5);
    }

    #[test]
    fn characteristic_values() {
        assert!((Pattern::Cardioid.factor(1.0) - 3.0).abs() < 1e-14);
        assert!(Pattern::Cardioid.factor(-1.0).abs() < 1e-14);
        assert!((Pattern::Hypercardioid.factor(1.0) - 4.0).abs() < 1e-14);
        assert!(Pattern::FigureEight.factor(0.0).abs() < 1e-14);
        assert!((Pattern::Supercardioid.factor(1.0) - 3.732).abs() < 1e-3);
    }

    #[test]
    fn names_round_trip() {
        for pattern in Pattern::ALL {
            assert_eq!(pattern.to_string().parse(), Ok(pattern));
        }
        assert!("Omni".parse::<Pattern>().is_err());
    }
}
