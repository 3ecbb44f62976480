//! Coefficients of materials, uniform or band by band.

use std::fmt;

use sonel_acoustics::Material;
use sonel_echogram::provenance::{ByName, Coefficients as Stated};
use sonel_scene::Value;

/// One number for all bands, or one for each, the lowest band first. Units and ranges are those of its [`MaterialKey`].
#[derive(Debug, Clone, PartialEq)]
pub enum Coefficients {
    /// The same in every band.
    Uniform(f64),
    /// One for each band of the scene.
    PerBand(Vec<f64>),
}

impl From<f64> for Coefficients {
    fn from(number: f64) -> Self {
        Self::Uniform(number)
    }
}

impl From<Vec<f64>> for Coefficients {
    fn from(numbers: Vec<f64>) -> Self {
        Self::PerBand(numbers)
    }
}

impl<const N: usize> From<[f64; N]> for Coefficients {
    fn from(numbers: [f64; N]) -> Self {
        Self::PerBand(numbers.into())
    }
}

impl From<Coefficients> for Value {
    fn from(coefficients: Coefficients) -> Self {
        match coefficients {
            Coefficients::Uniform(number) => number.into(),
            Coefficients::PerBand(numbers) => numbers.into(),
        }
    }
}

/// `0.3` or `[0.1,0.2]`.
impl fmt::Display for Coefficients {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uniform(number) => write!(f, "{number}"),
            Self::PerBand(numbers) => {
                let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
                write!(f, "[{}]", numbers.join(","))
            }
        }
    }
}

/// Coefficients of a material that may have other values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum MaterialKey {
    /// Absorption coefficient α, 0 … 1.
    Absorption,
    /// Scattering coefficient s, 0 … 1.
    Scattering,
    /// Diffuse reflection coefficient δ = s (1 − α), 0 … 1 − α.
    Diffuse,
    /// Transmission coefficient τ, 0 … α.
    Transmission,
    /// Sound reduction index R [dB], 0 or more: τ = 10^(−R/10).
    SoundReductionDb,
}

impl MaterialKey {
    /// All keys in the order of the interface.
    pub const ALL: [Self; 5] =
        [Self::Absorption, Self::Scattering, Self::Diffuse, Self::Transmission, Self::SoundReductionDb];

    /// Name of the key in a scene file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Absorption => "absorption",
            Self::Scattering => "scattering",
            Self::Diffuse => "diffuse",
            Self::Transmission => "transmission",
            Self::SoundReductionDb => "sound_reduction_db",
        }
    }

    /// The key of this `name`.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|key| key.name() == name)
    }
}

/// The `materials` of a map as a response was rendered with them, whose provenance states those that were `changed`. Coefficients that differ by
/// no more than `rounding` stay.
#[must_use]
pub fn rendered_with(materials: &[Material], changed: &ByName<Stated>, rounding: f64) -> Vec<Material> {
    let mut each = materials.to_vec();
    for Material { name, absorption, scattering, transmission, .. } in &mut each {
        let Some(stated) = changed.get(name) else { continue };
        let lists = [
            (absorption, &stated.absorption),
            (scattering, &stated.scattering),
            (transmission, &stated.transmission),
        ];
        for (values, stated) in lists {
            let both = values.iter_mut().zip(stated);
            for (value, stated) in both.filter(|(value, stated)| (**value - **stated).abs() > rounding) {
                *value = *stated;
            }
        }
    }
    each
}

/// The numbers in a text: one, or several between commas, in brackets or not.
pub(crate) fn parse(text: &str) -> Option<Coefficients> {
    let inner = text.trim();
    let list = inner.strip_prefix('[').map(|rest| rest.strip_suffix(']'));
    let numbers = |text: &str| -> Option<Vec<f64>> {
        text.split(',').map(|number| number.trim().parse().ok()).collect()
    };
    match list {
        Some(list) => numbers(list?).map(Coefficients::PerBand),
        None => match numbers(inner)?[..] {
            [number] => Some(Coefficients::Uniform(number)),
            ref numbers => Some(Coefficients::PerBand(numbers.to_vec())),
        },
    }
}
