//! Materials: absorption, scattering and transmission per band.
//!
//! Absorption α is the share of the incident energy that is not reflected; the reflected part is split by the scattering coefficient s into Lambert
//! and mirror; τ ≤ α passes straight on and α − τ is dissipated (docs/physics.md §1, §3).
//!
//! References: ISO 354:2003 (α), [ISO17497-1] (s) (docs/references.md).

use crate::absorption_law::AbsorptionLaw;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Coefficients of one material, one entry a band, each 0 … 1 and transmission ≤ absorption.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name, as in `usemtl` and in the scene file.
    pub name: String,
    /// Random-incidence absorption coefficient α per band: the part not reflected.
    pub absorption: Vec<f64>,
    /// Scattering coefficient s per band: the diffuse part of the reflected energy.
    pub scattering: Vec<f64>,
    /// Transmission coefficient τ per band: the part that passes straight on.
    pub transmission: Vec<f64>,
    /// Dependence of absorption on the angle of incidence.
    pub law: AbsorptionLaw,
    /// Source of the numbers.
    pub source: Option<String>,
}

/// A coefficient of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Coefficient {
    /// α.
    Absorption,
    /// s.
    Scattering,
    /// τ.
    Transmission,
}

impl std::fmt::Display for Coefficient {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Absorption => "absorption",
            Self::Scattering => "scattering",
            Self::Transmission => "transmission",
        })
    }
}

/// Why a material is impossible.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MaterialProblem {
    /// A list whose length is not the number of bands.
    #[error("{coefficient} has {given} entries, the bands are {expected}")]
    WrongLength {
        /// The list.
        coefficient: Coefficient,
        /// Length of the list.
        given: usize,
        /// Number of bands.
        expected: usize,
    },
    /// A coefficient outside 0 … 1 or not a number.
    #[error("{coefficient} is {given} in band {band}, outside 0 … 1")]
    OutOfRange {
        /// The coefficient.
        coefficient: Coefficient,
        /// Index of the band.
        band: usize,
        /// The number found.
        given: f64,
    },
    /// τ > α: more energy would pass than is not reflected.
    #[error("transmission {transmission} exceeds absorption {absorption} in band {band}")]
    TransmissionAboveAbsorption {
        /// Index of the band.
        band: usize,
        /// τ.
        transmission: f64,
        /// α.
        absorption: f64,
    },
    /// More than a wall of this law can absorb of a diffuse field.
    #[error("absorption {absorption} in band {band} is more than a {law} wall can have, {:.3}", law.largest())]
    TooSoft {
        /// The law.
        law: AbsorptionLaw,
        /// Index of the band.
        band: usize,
        /// α.
        absorption: f64,
    },
    /// τ > 0 of a wall whose absorption depends on the angle.
    #[error("transmission {transmission} in band {band}: nothing passes a {law} wall")]
    AngularPartition {
        /// The law.
        law: AbsorptionLaw,
        /// Index of the band.
        band: usize,
        /// τ.
        transmission: f64,
    },
}

impl Material {
    /// A material with the same α and s in each of `band_count` bands, and no transmission.
    pub fn uniform(name: &str, absorption: f64, scattering: f64, band_count: usize) -> Self {
        Self {
            name: name.to_owned(),
            absorption: vec![absorption; band_count],
            scattering: vec![scattering; band_count],
            transmission: vec![0.0; band_count],
            law: AbsorptionLaw::Uniform,
            source: None,
        }
    }

    /// Mirrored part of the incident energy in band `b`, (1−α)(1−s).
    pub fn specular(&self, b: usize) -> f64 {
        (1.0 - self.absorption[b]) * (1.0 - self.scattering[b])
    }

    /// Diffusely reflected part of the incident energy in band `b`, δ = (1−α)s.
    pub fn diffuse(&self, b: usize) -> f64 {
        (1.0 - self.absorption[b]) * self.scattering[b]
    }

    /// Part of the incident energy that passes straight on in band `b`, τ.
    pub fn transmission(&self, b: usize) -> f64 {
        self.transmission[b]
    }

    /// Part of the incident energy that stays in flight in band `b`, 1 − α + τ.
    pub fn passed_on(&self, b: usize) -> f64 {
        1.0 - self.absorption[b] + self.transmission[b]
    }

    /// Whether sound passes in some band.
    #[must_use]
    pub fn transmits(&self) -> bool {
        self.transmission.iter().any(|&transmission| transmission > 0.0)
    }

    /// Everything impossible about this material in `band_count` bands; empty when it is valid.
    pub fn problems(&self, band_count: usize) -> Vec<MaterialProblem> {
        use MaterialProblem as Problem;
        let (mut problems, law) = (Vec::new(), self.law);
        let lists = [
            (Coefficient::Absorption, &self.absorption),
            (Coefficient::Scattering, &self.scattering),
            (Coefficient::Transmission, &self.transmission),
        ];
        for (coefficient, list) in lists {
            let given = list.len();
            if given != band_count {
                problems.push(Problem::WrongLength { coefficient, given, expected: band_count });
            }
            let outside = list.iter().copied().enumerate().filter(|(_, given)| !(0.0..=1.0).contains(given));
            problems.extend(outside.map(|(band, given)| Problem::OutOfRange { coefficient, band, given }));
        }
        let [absorption, transmission] =
            [&self.absorption, &self.transmission].map(|list| || list.iter().copied().enumerate());
        let passing = transmission().zip(&self.absorption).filter(|((_, passed), lost)| passed > lost);
        problems.extend(passing.map(|((band, transmission), &absorption)| {
            Problem::TransmissionAboveAbsorption { band, transmission, absorption }
        }));
        let soft = absorption().filter(|&(_, lost)| lost > law.largest() && lost <= 1.0);
        problems.extend(soft.map(|(band, absorption)| Problem::TooSoft { law, band, absorption }));
        let passing = transmission().filter(|&(_, passed)| law.is_angular() && passed > 0.0);
        let angular = |(band, transmission)| Problem::AngularPartition { law, band, transmission };
        problems.extend(passing.map(angular));
        problems
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_sum_to_the_incident_energy() {
        let mut material = Material::uniform("wall", 0.3, 0.25, 2);
        material.transmission[1] = 0.1;
        assert!((material.diffuse(0) - 0.175).abs() < 1e-15);
        for b in 0..2 {
            let passed_on = material.specular(b) + material.diffuse(b) + material.transmission(b);
            assert!((passed_on - material.passed_on(b)).abs() < 1e-15);
            let dissipated = material.absorption[b] - material.transmission(b);
            assert!((passed_on + dissipated - 1.0).abs() < 1e-15);
        }
        assert_eq!(material.problems(2), []);
    }

    #[test]
    fn every_problem_is_found_at_once() {
        let mut material = Material::uniform("wall", 1.5, f64::NAN, 1);
        material.transmission = vec![0.2, 0.0];
        let messages: Vec<String> = material.problems(1).iter().map(ToString::to_string).collect();
        assert_eq!(
            messages,
            [
                "absorption is 1.5 in band 0, outside 0 … 1",
                "scattering is NaN in band 0, outside 0 … 1",
                "transmission has 2 entries, the bands are 1",
            ]
        );
        let mut leaky = Material::uniform("leaky", 0.1, 0.1, 1);
        leaky.transmission[0] = 0.2;
        assert_eq!(leaky.problems(1).len(), 1);
    }
}
