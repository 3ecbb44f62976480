//! How absorption depends on the angle of incidence.
//!
//! A locally reacting wall of the real specific impedance ζ absorbs, with μ = cos θ,
//!
//!   α(μ) = 4ζμ / (1 + ζμ)²,
//!
//! and in a diffuse field, by the integral of Paris ∫ α(μ) 2μ dμ,
//!
//!   α = (8/ζ²) [1 + ζ − 1/(1 + ζ) − 2 ln(1 + ζ)],
//!
//! at most 0.951, at ζ = 1.567. A tabulated coefficient is that mean; of the two impedances that have it the larger is taken, that of
//! hard walls.
//!
//! Reference: [Kuttruff2009] §2.3, §2.5.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Specific impedance at which a locally reacting wall absorbs most of a diffuse field: the maximum of the formula above.
pub const SOFTEST: f64 = 1.567_141_4;

/// Dependence of absorption on the angle of incidence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AbsorptionLaw {
    /// The same at every angle.
    #[default]
    Uniform,
    /// Law of a locally reacting wall with a real impedance.
    LocallyReacting,
}

impl AbsorptionLaw {
    /// All laws; the index of a law is its code in maps.
    pub const ALL: [Self; 2] = [Self::Uniform, Self::LocallyReacting];

    /// Code in maps.
    #[must_use]
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The law of a code in maps.
    #[must_use]
    pub fn of_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// Whether α depends on the angle.
    #[must_use]
    pub fn is_angular(self) -> bool {
        self != Self::Uniform
    }

    /// Largest α in a diffuse field, 0 … 1.
    #[must_use]
    pub fn largest(self) -> f64 {
        match self {
            Self::Uniform => 1.0,
            Self::LocallyReacting => random_incidence(SOFTEST),
        }
    }

    /// The number that stands for a wall which absorbs `absorption` of a diffuse field, at most [`Self::largest`]: α where it is uniform,
    /// the specific impedance where the wall reacts locally.
    #[must_use]
    pub fn parameter(self, absorption: f64) -> f64 {
        match self {
            Self::Uniform => absorption,
            Self::LocallyReacting => impedance(absorption).unwrap_or(SOFTEST),
        }
    }

    /// α at the cosine `cosine` of the angle of incidence of a wall with `parameter`.
    #[inline]
    #[must_use]
    pub fn absorption_at(self, parameter: f64, cosine: f64) -> f64 {
        match self {
            Self::Uniform => parameter,
            Self::LocallyReacting => absorption_at(parameter, cosine),
        }
    }

    /// Mean of α over diffuse incidence with cosines in `range`, of a wall with `parameter`.
    #[must_use]
    pub fn mean_between(self, parameter: f64, range: [f64; 2]) -> f64 {
        match self {
            Self::Uniform => parameter,
            Self::LocallyReacting => mean_absorption_between(parameter, range),
        }
    }
}

impl fmt::Display for AbsorptionLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Uniform => "uniform",
            Self::LocallyReacting => "locally-reacting",
        })
    }
}

impl FromStr for AbsorptionLaw {
    type Err = ();

    fn from_str(word: &str) -> Result<Self, ()> {
        Self::ALL.into_iter().find(|law| law.to_string() == word).ok_or(())
    }
}

/// Absorption coefficient in a diffuse field of a wall of the specific impedance `impedance`.
#[must_use]
pub fn random_incidence(impedance: f64) -> f64 {
    mean_absorption_between(impedance, [0.0, 1.0])
}

/// Specific impedance ζ ≥ 1.567 of the wall that absorbs `absorption` of a diffuse field; infinite for 0, [`None`] above
/// [`AbsorptionLaw::largest`].
#[must_use]
pub fn impedance(absorption: f64) -> Option<f64> {
    impedance_by(absorption, random_incidence)
}

/// Specific impedance ζ ≥ 1.567 that absorbs `absorption` where any absorbs `of(ζ)`, 8/ζ at most.
pub(crate) fn impedance_by(absorption: f64, of: impl Fn(f64) -> f64) -> Option<f64> {
    if absorption <= 0.0 {
        return Some(f64::INFINITY);
    }
    // α falls from its maximum below 8/ζ; halving the logarithm of ζ finds it to the last digits.
    let (mut low, mut high) = (SOFTEST, 8.0 / absorption);
    if absorption > of(low) {
        return None;
    }
    for _ in 0..200 {
        let middle = libm::sqrt(low * high);
        (low, high) = if of(middle) > absorption { (middle, high) } else { (low, middle) };
    }
    Some(libm::sqrt(low * high))
}

/// α at the cosine `cosine` of the angle of incidence.
#[must_use]
pub fn absorption_at(impedance: f64, cosine: f64) -> f64 {
    if !impedance.is_finite() {
        return 0.0;
    }
    let relative = impedance * cosine;
    4.0 * relative / ((1.0 + relative) * (1.0 + relative))
}

/// Mean of α over diffuse incidence with cosines in `range`.
#[must_use]
pub fn mean_absorption_between(impedance: f64, [from, to]: [f64; 2]) -> f64 {
    if !impedance.is_finite() {
        return 0.0;
    }
    // ∫ α 2μ dμ = (8/ζ²) (x − 2 ln(1+x) + x/(1+x)), x = ζμ; below x = 0.01 its series x³/3 − x⁴/2 + … has more digits.
    let primitive = |cosine: f64| {
        let x = impedance * cosine;
        let sum = if x < 0.01 {
            x * x * x * (1.0 / 3.0 - x * (0.5 - x * (0.6 - x * (2.0 / 3.0 - x * (5.0 / 7.0 - x * 0.75)))))
        } else {
            x - 2.0 * libm::log1p(x) + x / (1.0 + x)
        };
        8.0 * sum / (impedance * impedance)
    };
    (primitive(to) - primitive(from)) / (to * to - from * from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tabulated_coefficient_is_the_diffuse_mean_of_its_law() {
        for absorption in [1e-4, 0.02, 0.3, 0.9, 0.95] {
            let impedance = impedance(absorption).unwrap();
            assert!((random_incidence(impedance) / absorption - 1.0).abs() < 1e-9, "{absorption}");
            let steps = 200_000;
            let sum: f64 = (0..steps)
                .map(|step| (f64::from(step) + 0.5) / f64::from(steps))
                .map(|cosine| absorption_at(impedance, cosine) * 2.0 * cosine / f64::from(steps))
                .sum();
            assert!((sum / absorption - 1.0).abs() < 1e-6, "{absorption}: {sum}");
            assert!(
                (sum / absorption_at(impedance, 1.0) - 1.0).abs() > 1e-3,
                "it is not that of normal incidence"
            );
        }
    }

    #[test]
    fn every_law_has_its_diffuse_mean_and_its_code() {
        for (code, law) in (0..).zip(AbsorptionLaw::ALL) {
            assert!(law.code() == code && AbsorptionLaw::of_code(code) == Some(law));
            for absorption in [0.0, 0.02, 0.3, 0.95] {
                let mean = law.mean_between(law.parameter(absorption), [0.0, 1.0]);
                assert!((mean - absorption).abs() < 1e-9, "{law}, {absorption}: {mean}");
            }
        }
        assert_eq!(AbsorptionLaw::of_code(AbsorptionLaw::ALL.len() as u8), None);
    }

    #[test]
    fn parts_of_the_hemisphere_add_up() {
        for impedance in [1.6, 20.0, 4e4] {
            let edges = [0.0, 1e-4, 3e-3, 0.02, 0.1, 0.5, 1.0];
            let part = |pair: &[f64]| {
                mean_absorption_between(impedance, [pair[0], pair[1]])
                    * (pair[1] * pair[1] - pair[0] * pair[0])
            };
            let sum: f64 = edges.windows(2).map(part).sum();
            assert!((sum / random_incidence(impedance) - 1.0).abs() < 1e-10, "{impedance}");
            let narrow = mean_absorption_between(impedance, [0.3, 0.3001]);
            assert!((narrow / absorption_at(impedance, 0.30005) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_wall_absorbs_no_more_than_its_law_allows() {
        assert!((AbsorptionLaw::LocallyReacting.largest() - 0.951).abs() < 5e-4);
        assert!(impedance(0.96).is_none() && impedance(0.0).is_some_and(f64::is_infinite));
        assert!(absorption_at(f64::INFINITY, 0.5).abs() <= 0.0);
    }
}
