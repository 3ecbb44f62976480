//! Which effects are simulated, per band, and why.
//!
//! `--effects SPEC` starts from `auto`, `all` or `none` and applies changes in order: `auto,-air,+directivity`. The names
//! are those of docs/interface.md; an effect that is not built yet is off, with that reason, whatever was asked for.

use std::str::FromStr;

use sonel_acoustics::Directivity;
use sonel_map::{EffectState, Mode};
use sonel_scene::Scene;
use thiserror::Error;

/// An effect that a scene may call for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Edge diffraction of deterministic paths.
    Diffraction,
    /// Bending of packets at edges.
    Bending,
    /// Sound through partitions.
    Transmission,
    /// Bending by gradients of the medium.
    Refraction,
    /// Attenuation by air.
    Air,
    /// Directivity of sources.
    Directivity,
}

impl Effect {
    /// All effects in the order of the interface.
    pub const ALL: [Self; 6] = [
        Self::Diffraction,
        Self::Bending,
        Self::Transmission,
        Self::Refraction,
        Self::Air,
        Self::Directivity,
    ];

    /// Its name in `--effects`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Diffraction => "diffraction",
            Self::Bending => "bending",
            Self::Transmission => "transmission",
            Self::Refraction => "refraction",
            Self::Air => "air",
            Self::Directivity => "directivity",
        }
    }
}

/// A specification that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum EffectSpecError {
    /// The first word is none of the three bases.
    #[error("effects begin with auto, all or none, not with \"{0}\" (example: auto,-air)")]
    Base(String),
    /// A change without a sign.
    #[error("write +{0} or -{0}: a change of effects says whether it adds or removes")]
    Sign(String),
    /// No such effect.
    #[error(
        "there is no effect \"{0}\": choose among diffraction, bending, transmission, refraction, air, directivity"
    )]
    Unknown(String),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wish {
    Auto,
    On,
    Off,
}

/// What the user asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EffectSpec {
    wishes: [Wish; 6],
}

impl Default for EffectSpec {
    fn default() -> Self {
        Self { wishes: [Wish::Auto; 6] }
    }
}

impl FromStr for EffectSpec {
    type Err = EffectSpecError;

    fn from_str(text: &str) -> Result<Self, EffectSpecError> {
        let mut words = text.split(',').map(str::trim);
        let base = match words.next().unwrap_or_default() {
            "auto" => Wish::Auto,
            "all" => Wish::On,
            "none" => Wish::Off,
            other => return Err(EffectSpecError::Base(other.to_owned())),
        };
        let mut wishes = [base; 6];
        for word in words {
            let (wish, name) = match (word.strip_prefix('+'), word.strip_prefix('-')) {
                (Some(name), _) => (Wish::On, name),
                (_, Some(name)) => (Wish::Off, name),
                _ => return Err(EffectSpecError::Sign(word.to_owned())),
            };
            let effect = Effect::ALL.into_iter().find(|effect| effect.name() == name);
            let effect = effect.ok_or_else(|| EffectSpecError::Unknown(name.to_owned()))?;
            wishes[effect as usize] = wish;
        }
        Ok(Self { wishes })
    }
}

/// Decides every effect for `scene`, which is traced in `mode`, and changes the scene accordingly: air switched on or off, directivities dropped.
pub fn apply(spec: &EffectSpec, scene: &mut Scene, mode: Mode) -> Vec<EffectState> {
    Effect::ALL.into_iter().map(|effect| decide(effect, spec.wishes[effect as usize], scene, mode)).collect()
}

fn decide(effect: Effect, wish: Wish, scene: &mut Scene, mode: Mode) -> EffectState {
    let bands = scene.bands.count();
    let (on, reason) = match effect {
        Effect::Diffraction => decide_diffraction(wish, scene, mode),
        Effect::Air => decide_air(wish, scene),
        Effect::Directivity => decide_directivity(wish, scene),
        _ => (vec![false; bands], "not built yet".to_owned()),
    };
    EffectState { name: effect.name().to_owned(), on, reason }
}

/// Edges are asked for, since what they are worth in a scene is not estimated yet; in the paper's mode they are part of the method.
fn decide_diffraction(wish: Wish, scene: &Scene, mode: Mode) -> (Vec<bool>, String) {
    let edges = || scene.geometry().map_or(0, |geometry| geometry.diffracting_edges().count());
    let (on, reason) = match (wish, mode) {
        (Wish::Off, _) => (false, "asked for".to_owned()),
        (Wish::Auto, Mode::Accurate) => (false, "left out unless asked for with +diffraction".to_owned()),
        _ => match (edges(), mode) {
            (0, _) => (false, "no edge diffracts".to_owned()),
            (count, Mode::Paper) => {
                (true, format!("the paper's: zones of half a wavelength on either side of {count} edges"))
            }
            (count, Mode::Accurate) => {
                (true, format!("asked for: {count} edges, direct path and mirror images of low order"))
            }
        },
    };
    (vec![on; scene.bands.count()], reason)
}

fn decide_air(wish: Wish, scene: &mut Scene) -> (Vec<bool>, String) {
    match wish {
        Wish::Off => scene.air_attenuation.fill(0.0),
        Wish::On => {
            for (band, attenuation) in scene.air_attenuation.iter_mut().enumerate() {
                *attenuation = scene.air.energy_attenuation(scene.bands.exact_midband(band));
            }
        }
        Wish::Auto => {}
    }
    let on: Vec<bool> = scene.air_attenuation.iter().map(|&m| m > 0.0).collect();
    let strongest = scene.air_attenuation.iter().copied().fold(0.0, f64::max);
    let asked = match wish {
        Wish::Auto => "as the scene says",
        Wish::On | Wish::Off => "asked for",
    };
    let reason = if strongest > 0.0 {
        // 10 lg e dB per unit of m · length.
        format!("{asked}: up to {:.1} dB per km", 10.0 * std::f64::consts::LOG10_E * strongest * 1000.0)
    } else {
        format!("{asked}: no attenuation")
    };
    (on, reason)
}

fn decide_directivity(wish: Wish, scene: &mut Scene) -> (Vec<bool>, String) {
    let directional = scene.sources.iter().filter(|source| source.directivity != Directivity::Omni).count();
    if wish == Wish::Off {
        for source in &mut scene.sources {
            source.directivity = Directivity::Omni;
        }
    }
    let (on, reason) = match (directional, wish) {
        (0, _) => (false, "every source is omnidirectional".to_owned()),
        (_, Wish::Off) => (false, "asked for: sources treated as omnidirectional".to_owned()),
        (count, _) => (true, format!("{count} of {} sources are directional", scene.sources.len())),
    };
    (vec![on; scene.bands.count()], reason)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{Bands, Material};
    use sonel_geometry::Mesh;

    #[test]
    fn specifications_are_read_in_order() {
        let spec: EffectSpec = "auto,-air,+diffraction".parse().unwrap();
        assert_eq!(spec.wishes[Effect::Air as usize], Wish::Off);
        assert_eq!(spec.wishes[Effect::Diffraction as usize], Wish::On);
        assert_eq!(spec.wishes[Effect::Bending as usize], Wish::Auto);
    }

    /// A single panel has edges, a box has none.
    #[test]
    fn the_paper_s_mode_diffracts_wherever_there_are_edges() {
        let bands = Bands::octaves();
        let walls = || vec![Material::uniform("walls", 0.1, 0.5, bands.count())];
        let whole = Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]);
        let mut panel = whole.clone();
        panel.triangles.truncate(2);
        let is_on = |mesh: &Mesh, spec: &str, mode: Mode| {
            let mut scene = Scene::from_parts(mesh.clone(), walls(), bands.clone(), 1.0);
            let states = apply(&spec.parse().unwrap(), &mut scene, mode);
            states[Effect::Diffraction as usize].on.iter().all(|&on| on)
        };
        assert!(is_on(&panel, "auto", Mode::Paper) && !is_on(&panel, "auto,-diffraction", Mode::Paper));
        assert!(!is_on(&panel, "auto", Mode::Accurate) && is_on(&panel, "auto,+diffraction", Mode::Accurate));
        assert!(!is_on(&whole, "auto", Mode::Paper) && !is_on(&whole, "all", Mode::Paper));
    }

    #[test]
    fn wrong_specifications_say_what_is_right() {
        let error = |text: &str| text.parse::<EffectSpec>().unwrap_err().to_string();
        assert!(error("some").contains("auto, all or none"));
        assert!(error("auto,air").contains("+air or -air"));
        assert!(error("auto,+echo").contains("diffraction, bending"));
    }
}
