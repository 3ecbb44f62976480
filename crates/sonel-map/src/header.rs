//! The header: settings, effects and scene that produced the paths.

use sonel_scene::{Effect, Scene};

use crate::emission::EmissionLayout;
use crate::leads::{MOST_SETS, set_count};
use crate::spectral::Spectral;

/// Method that the paths were traced for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Weighted packets that carry all bands.
    Accurate,
    /// The founding paper's method: one band a packet, roulette on absorption alone.
    Paper,
}

impl Mode {
    /// Name in docs/interface.md.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Accurate => "accurate",
            Self::Paper => "paper",
        }
    }
}

/// Settings that decided the paths besides the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Emissions per source; with [`Spectral::PerBand`] per source and band.
    pub emissions: u64,
    /// Seed of every random stream.
    pub seed: u64,
    /// Number of batches, G.
    pub batches: u32,
    /// Survival exponent β: a packet survives an arrival with probability a^β.
    pub survival: f64,
    /// Whether bands share paths.
    pub spectral: Spectral,
    /// The method.
    pub mode: Mode,
}

impl Default for Settings {
    /// 16 000 emissions (docs/planning.md), seed 1, 32 batches, β = 0.15, shared bands.
    fn default() -> Self {
        Self {
            emissions: 16_000,
            seed: 1,
            batches: 32,
            survival: 0.15,
            spectral: Spectral::Shared,
            mode: Mode::Accurate,
        }
    }
}

impl Settings {
    /// The numbering of one source's emissions in `scene`.
    #[must_use]
    pub fn layout(&self, scene: &Scene) -> EmissionLayout {
        let bands = scene.bands.count();
        let packets = match self.spectral {
            Spectral::Shared => 1,
            Spectral::PerBand => bands as u64,
        };
        EmissionLayout {
            total: self.emissions.saturating_mul(packets),
            bands: bands as u32,
            sets: set_count(scene).min(MOST_SETS) as u32,
            batches: self.batches,
        }
    }
}

/// Part of a run that a map holds, I of N from 1; 1 of 1 is all of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShardRange {
    /// I.
    pub index: u32,
    /// N.
    pub count: u32,
}

impl ShardRange {
    /// The whole run.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// The chunks of this shard out of `chunks`: contiguous, complete over all shards, as even as they can be.
    #[must_use]
    pub fn chunks(&self, chunks: u64) -> std::ops::Range<u64> {
        let border = |i: u32| (u128::from(chunks) * u128::from(i) / u128::from(self.count)) as u64;
        border(self.index - 1)..border(self.index)
    }
}

/// Whether an effect was simulated, per band, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectState {
    /// The effect.
    pub effect: Effect,
    /// On or off, per band.
    pub on: Vec<bool>,
    /// The reason in words.
    pub reason: String,
}

/// All provenance of a map.
#[derive(Debug, Clone)]
pub struct MapHeader {
    /// Version of the program that traced it.
    pub tool_version: String,
    /// Settings that decided the paths.
    pub settings: Settings,
    /// Part of the run.
    pub shard: ShardRange,
    /// Effects, on or off.
    pub effects: Vec<EffectState>,
    /// The compiled scene.
    pub scene: Scene,
}

impl MapHeader {
    /// Decision about `effect`, if it is stated.
    #[must_use]
    pub fn effect(&self, effect: Effect) -> Option<&EffectState> {
        self.effects.iter().find(|state| state.effect == effect)
    }

    /// Wavelength at the centre of every band in which packets are diffracted in the paper's mode [m], zero in the others; [`None`] where they are in none.
    #[must_use]
    pub fn diffracted_wavelengths(&self) -> Option<Vec<f64>> {
        let effect = self.effect(Effect::Diffraction)?;
        let wavelength =
            |(&on, frequency): (&bool, &f64)| if on { self.scene.speed_of_sound / frequency } else { 0.0 };
        let wavelengths = effect.on.iter().zip(self.scene.bands.nominal()).map(wavelength).collect();
        effect.on.contains(&true).then_some(wavelengths)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_cover_all_chunks_once() {
        for (chunks, count) in [(0, 1), (1, 8), (97, 8), (98, 3)] {
            let mut next = 0;
            for index in 1..=count {
                let range = ShardRange { index, count }.chunks(chunks);
                assert_eq!(range.start, next);
                next = range.end;
            }
            assert_eq!(next, chunks);
        }
    }
}
