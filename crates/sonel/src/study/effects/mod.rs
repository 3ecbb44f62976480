//! Decides which effects are simulated, per band, with a reason.
//!
//! For each effect a bound is derived for the change of levels and reverberation times without it. `auto` leaves it out where both are below a tenth of a just-noticeable difference
//! ([`THRESHOLD`]). A new effect is a variant of [`Effect`], an arm of [`decide`] and a module with its bound.

mod air;
mod boundary;
mod edges;
mod skips;
mod spec;

use std::sync::Arc;

use sonel_acoustics::{Material, just_noticeable};
use sonel_geometry::{Geometry, GeometryError, Surface, SurfaceId};
use sonel_map::leads::LEAST_THROUGH;
use sonel_map::{EffectState, Mode};
pub use sonel_scene::Effect;
use sonel_scene::Scene;

pub use skips::{Skip, skips};
pub use spec::{EffectSpec, EffectSpecError};

use spec::Request;

/// Change below which an effect may be left out, unless the specification states another [JND]. Chosen: a tenth of what is heard, so that ten
/// omissions are not.
pub const THRESHOLD: f64 = 0.1;

/// The reason of effects that the user decided about.
const ASKED: &str = "requested";

/// The most that leaving an effect out changes, per band.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// In any level [dB].
    pub level_db: Vec<f64>,
    /// In any reverberation time, of itself [1].
    pub decay: Vec<f64>,
}

impl Bound {
    /// Nothing in any of `bands`.
    fn nothing(bands: usize) -> Self {
        Self { level_db: vec![0.0; bands], decay: vec![0.0; bands] }
    }

    /// Bands in which it is beyond so many just-noticeable differences.
    fn exceeds(&self, threshold: f64) -> Vec<bool> {
        let (level_db, decay) =
            (threshold * just_noticeable::LEVEL_DB, threshold * just_noticeable::EARLY_DECAY_TIME);
        let exceeds = |(&level, &time): (&f64, &f64)| level > level_db || time > decay;
        self.level_db.iter().zip(&self.decay).map(exceeds).collect()
    }

    /// Takes the larger of both in every band.
    fn extend(&mut self, other: &Self) {
        let mine = self.level_db.iter_mut().chain(&mut self.decay);
        mine.zip(other.level_db.iter().chain(&other.decay))
            .for_each(|(mine, other)| *mine = mine.max(*other));
    }
}

/// Decision about an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// The effect.
    pub effect: Effect,
    /// Whether it is simulated, per band.
    pub on: Vec<bool>,
    /// Largest change when it is left out; none where it was not requested or cannot be estimated.
    pub bound: Option<Bound>,
    /// Why, in words.
    pub reason: String,
    /// Cost in words; empty where there is none.
    pub cost: String,
}

impl Decision {
    fn new(effect: Effect, on: Vec<bool>, reason: String) -> Self {
        Self { effect, on, bound: None, reason, cost: String::new() }
    }

    /// Takes what `other` materials call for, too.
    fn extend(&mut self, other: Self) {
        let calls_for_more = self.on.iter().zip(&other.on).any(|(&mine, &others)| others && !mine);
        for (mine, others) in self.on.iter_mut().zip(&other.on) {
            *mine |= others;
        }
        if let (Some(mine), Some(others)) = (&mut self.bound, &other.bound) {
            mine.extend(others);
        }
        if calls_for_more {
            self.reason = format!("{}; with variants of the materials {}", self.reason, other.reason);
            self.cost = other.cost;
        }
    }

    /// What a map says of it.
    #[must_use]
    pub fn state(&self) -> EffectState {
        EffectState { effect: self.effect, on: self.on.clone(), reason: self.reason.clone() }
    }
}

/// Decides every effect for `scene`, whose walls are `geometry` and which is traced in `mode`, and changes the scene accordingly: air switched on or off,
/// directivities dropped. The decision is a function of scene and `spec` alone. An effect is on that the materials or any of their variants call for.
#[must_use]
pub fn decide(spec: &EffectSpec, mode: Mode, scene: &mut Scene, geometry: &Geometry) -> Vec<Decision> {
    let mut scenes = in_variants(scene);
    let mut decisions = decide_one(spec, mode, scene, geometry);
    for variant in &mut scenes {
        let others = decide_one(spec, mode, variant, geometry);
        decisions.iter_mut().zip(others).for_each(|(decision, other)| decision.extend(other));
    }
    if !decisions[Effect::Transmission as usize].on.contains(&true) {
        scene.leave_out(Effect::Transmission);
    }
    decisions
}

/// `scene` with its variants in the place of the materials: the first of all, the second of all, …
fn in_variants(scene: &Scene) -> Vec<Scene> {
    let most = scene.variants.iter().map(Vec::len).max().unwrap_or(0);
    let with = |number: usize| {
        let others = scene.materials.iter().zip(&scene.variants);
        let pick = |(own, variants): (&Material, &Vec<Material>)| {
            variants.get(number).or(variants.last()).unwrap_or(own).clone()
        };
        Scene {
            materials: others.map(pick).collect(),
            variants: Vec::new(),
            designs: Vec::new(),
            ..scene.clone()
        }
    };
    (0..most).map(with).collect()
}

/// [`decide`] for the materials of `scene`.
fn decide_one(spec: &EffectSpec, mode: Mode, scene: &mut Scene, geometry: &Geometry) -> Vec<Decision> {
    let decide = |effect| {
        let request = spec.request(effect);
        match effect {
            Effect::Diffraction => edges::decide(request, mode, scene, geometry),
            Effect::Boundary => boundary::decide(request, mode, scene, geometry),
            Effect::Air => air::decide(request, spec.threshold(), scene, geometry),
            Effect::Directivity => decide_directivity(request, scene),
            Effect::Transmission => decide_transmission(request, mode, scene, geometry),
            Effect::Refraction => decide_refraction(request, mode, scene),
        }
    };
    Effect::ALL.map(decide).into()
}

/// Decisions that a map traced in `mode` states: those that are made in rendering are left out.
#[must_use]
pub fn states(decisions: &[Decision], mode: Mode) -> Vec<EffectState> {
    let is_traced =
        |decision: &&Decision| mode == Mode::Paper || !EffectSpec::RENDERED.contains(&decision.effect);
    decisions.iter().filter(is_traced).map(Decision::state).collect()
}

/// Leaves regions of other air and the gradient of the speed of sound out of `scene` where `spec` or `mode` does without refraction.
/// Returns its walls, which are `geometry` unless interfaces were left out.
///
/// # Errors
/// When nothing but interfaces was there.
pub fn leave_regions_out(
    spec: &EffectSpec,
    mode: Mode,
    scene: &mut Scene,
    geometry: impl Into<Arc<Geometry>>,
) -> Result<Arc<Geometry>, GeometryError> {
    let has_interfaces = scene.media.is_some();
    let is_even = spec.request(Effect::Refraction) == Request::Off || mode == Mode::Paper;
    if is_even {
        scene.leave_out(Effect::Refraction);
    }
    if is_even && has_interfaces { scene.geometry().map(Arc::new) } else { Ok(geometry.into()) }
}

/// Why an effect is left out that the founding paper has not: that is `paper`.
fn left_out(request: Request, mode: Mode, paper: &'static str) -> Option<&'static str> {
    match (request, mode) {
        (Request::Off, _) => Some(ASKED),
        (_, Mode::Paper) => Some(paper),
        _ => None,
    }
}

/// Refraction is simulated as soon as a scene has several airs.
fn decide_refraction(request: Request, mode: Mode, scene: &Scene) -> Decision {
    let bands = scene.bands.count();
    let off = |reason: String| Decision::new(Effect::Refraction, vec![false; bands], reason);
    if scene.sound_speed_gradient != 0.0 {
        return decide_gradient(scene);
    }
    let Some(media) = &scene.media else {
        let bound = Some(Bound::nothing(bands));
        return Decision { bound, ..off("the scene has one air".to_owned()) };
    };
    if let Some(why) = left_out(request, mode, "the paper has one air") {
        return off(format!("{why}, regions have the air of the scene"));
    }
    let airs =
        media.regions.iter().map(|region| format!("\"{}\" {:.1} m/s", region.name, region.speed_of_sound));
    let reason = format!(
        "the scene {:.1} m/s, {}; receiver spheres estimate paths that met an interface since their last diffuse reflection",
        scene.speed_of_sound,
        airs.collect::<Vec<_>>().join(", ")
    );
    let cost = "noise of receiver spheres, also in direct sound through an interface".to_owned();
    Decision { cost, ..Decision::new(Effect::Refraction, vec![true; bands], reason) }
}

/// A gradient of the speed of sound is simulated where a scene states one.
fn decide_gradient(scene: &Scene) -> Decision {
    let reason = format!(
        "{:.1} m/s at height 0, {} m/s more per metre; paths are arcs, receiver spheres estimate specular reflections",
        scene.speed_of_sound, scene.sound_speed_gradient
    );
    let cost = "several rays a segment, noise of receiver spheres".to_owned();
    Decision { cost, ..Decision::new(Effect::Refraction, vec![true; scene.bands.count()], reason) }
}

/// Transmission is simulated as soon as a material in use lets anything through; without it that is turned to heat.
fn decide_transmission(request: Request, mode: Mode, scene: &Scene, geometry: &Geometry) -> Decision {
    let bands = scene.bands.count();
    let partitions: Vec<&Surface> =
        geometry.surfaces().iter().filter(|s| is_partition(&scene.materials[s.material as usize])).collect();
    let off = |reason: String| Decision::new(Effect::Transmission, vec![false; bands], reason);
    if partitions.is_empty() {
        let bound = Some(Bound::nothing(bands));
        return Decision { bound, ..off("no material transmits".to_owned()) };
    }
    if let Some(why) = left_out(request, mode, "the paper has no transmission") {
        return off(format!("{why}, transmitted energy is absorbed"));
    }
    let passes = |band: usize| {
        partitions.iter().any(|s| scene.materials[s.material as usize].transmission[band] > 0.0)
    };
    let on = (0..bands).map(passes).collect();
    Decision {
        cost: format!("{} % of the packets that survive at a partition pass it", 100.0 * LEAST_THROUGH),
        ..Decision::new(Effect::Transmission, on, describe_partitions(scene, geometry))
    }
}

fn is_partition(material: &Material) -> bool {
    material.transmission.iter().any(|&transmission| transmission > 0.0)
}

/// Which materials sound passes, and how thick the walls are of which two faces are one partition.
fn describe_partitions(scene: &Scene, geometry: &Geometry) -> String {
    let described = scene.materials.iter().enumerate().filter(|(_, material)| is_partition(material)).map(
        |(index, material)| {
            let surfaces = (0..geometry.surfaces().len() as u32).map(SurfaceId);
            let own = surfaces.filter(|&id| geometry.surface(id).material as usize == index);
            let thicknesses: Vec<f64> = own.filter_map(|id| geometry.partition_thickness(id)).collect();
            let thinnest = thicknesses.iter().copied().fold(f64::INFINITY, f64::min);
            let thickest = thicknesses.iter().copied().fold(0.0, f64::max);
            match thicknesses.len() {
                0 => format!("\"{}\"", material.name),
                faces => format!(
                    "\"{}\" ({faces} faces of walls {thinnest:.3} … {thickest:.3} m thick)",
                    material.name
                ),
            }
        },
    );
    format!("sound passes {}", described.collect::<Vec<_>>().join(", "))
}

/// Directivity changes no more than the weight of emissions, and is heard as soon as a source has one.
fn decide_directivity(request: Request, scene: &mut Scene) -> Decision {
    let bands = scene.bands.count();
    let directional = scene.sources.iter().filter(|source| !source.directivity.is_omni()).count();
    if request == Request::Off {
        scene.leave_out(Effect::Directivity);
    }
    let (on, reason) = match (directional, request) {
        (0, _) => (false, "every source is omnidirectional".to_owned()),
        (_, Request::Off) => (false, format!("{ASKED}, sources treated as omnidirectional")),
        (count, _) => (true, format!("{count} of {} sources are directional", scene.sources.len())),
    };
    let bound = (directional == 0).then(|| Bound::nothing(bands));
    let cost = if on { "one factor an emission".to_owned() } else { String::new() };
    Decision { bound, cost, ..Decision::new(Effect::Directivity, vec![on; bands], reason) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{Bands, Material};
    use sonel_geometry::Mesh;

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
            let geometry = scene.geometry().unwrap();
            let spec = spec.parse().unwrap();
            let decisions = decide(&spec, mode, &mut scene, &geometry);
            // They are printed behind a colon.
            assert!(decisions.iter().all(|decision| !decision.reason.contains(':')), "{decisions:?}");
            decisions[Effect::Diffraction as usize].on.iter().all(|&on| on)
        };
        assert!(is_on(&panel, "auto", Mode::Paper) && !is_on(&panel, "auto,-diffraction", Mode::Paper));
        assert!(is_on(&panel, "auto,+diffraction", Mode::Accurate));
        assert!(!is_on(&whole, "auto", Mode::Paper) && !is_on(&whole, "all", Mode::Paper));
    }
}
