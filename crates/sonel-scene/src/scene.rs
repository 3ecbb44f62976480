//! The compiled scene: everything a trace or a rendering needs, checked and in SI.
//!
//! Coordinates are those of the scene file, in metres, whatever axis is up ([`Scene::up`]).

use glam::DVec3;
use serde::{Deserialize, Serialize};
use sonel_acoustics::{
    Air, Bands, Directivity, Material, Pattern, SourceChange, equivalent_absorption_area, sabine_time,
};
use sonel_geometry::{FaceKind, Geometry, GeometryError, LARGEST_TURN, Mesh, SpeedProfile};

use crate::media::Media;
use crate::notation;

/// Power level of a source that states none [dB re 1 pW].
pub const DEFAULT_POWER_LEVEL_DB: f64 = 90.0;
/// Scattering coefficient of a material that states neither scattering nor diffuse.
pub const DEFAULT_SCATTERING: f64 = 0.1;
/// A scene that states no duration lasts at least this many times its largest Sabine time.
pub const DURATION_PER_SABINE_TIME: f64 = 1.2;

/// Longest duration of a scene [s]: an hour. No room reverberates for more than a few minutes, and a lossless one never ends.
pub const LONGEST_DURATION: f64 = 3600.0;
/// Longest duration taken unless the scene states one [s]: large cathedrals have T of 10 to 13 s, reverberation chambers up to 15 s at low
/// frequencies, which makes 18 s.
pub const LONGEST_DEFAULT_DURATION: f64 = 30.0;

/// A scene after loading: no path, no unit but SI, every list as long as there are bands.
///
/// The mesh is not part of the serialised form: it is written by whoever carries the scene, in a form of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Name for people.
    pub name: String,
    /// Frequency bands; every per-band list below has their count.
    pub bands: Bands,
    /// State of the air.
    pub air: Air,
    /// Speed of sound [m/s], at height 0 where it has a gradient.
    pub speed_of_sound: f64,
    /// Gradient of the speed of sound along [`Scene::up`] [1/s]; 0 in even air.
    pub sound_speed_gradient: f64,
    /// Energy attenuation m of the air per band [1/m]; all 0 when switched off.
    pub air_attenuation: Vec<f64>,
    /// Duration of the echograms [s].
    pub duration: f64,
    /// Whether the scene file states no duration: it is 1.2 times the largest Sabine time, and a run may last longer.
    #[serde(skip)]
    pub has_default_duration: bool,
    /// Materials; [`sonel_geometry::MeshTriangle::material`] indexes this list.
    pub materials: Vec<Material>,
    /// Other materials that a map shall carry besides, for each of `materials`; empty where it shall carry none.
    pub variants: Vec<Vec<Material>>,
    /// Named choices among `variants`.
    pub designs: Vec<Design>,
    /// Walls [m].
    #[serde(skip)]
    pub mesh: Mesh,
    /// Places that alone are air, whatever the walls say [m]; none where the walls tell.
    pub air_at: Vec<DVec3>,
    /// Sources, at least one in a loaded scene.
    pub sources: Vec<Source>,
    /// Receivers, possibly none: a map serves any.
    pub receivers: Vec<Receiver>,
    /// Unit vector that points up in the axes of the scene file.
    pub up: DVec3,
    /// Regions of other air, where there are any.
    pub media: Option<Media>,
    /// BLAKE3 digest of the scene file's bytes; zero for a scene made in code.
    pub digest: [u8; 32],
    /// BLAKE3 digest of the mesh file's bytes; of nothing for a shoebox; zero for a scene made in code.
    pub mesh_digest: [u8; 32],
}

/// A named choice of materials, which are those of the scene where it states none.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Design {
    /// Name, unique among the designs.
    pub name: String,
    /// Pairs of a material and one of its variants, indices of [`Scene::variants`].
    pub choices: Vec<(u32, u32)>,
}

/// A point source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Name, unique among the sources.
    pub name: String,
    /// Position [m].
    pub position: DVec3,
    /// Power level per band [dB re 1 pW].
    pub power_level_db: Vec<f64>,
    /// Radiation about [`Source::aim`].
    pub directivity: Directivity,
    /// Unit vector.
    pub aim: DVec3,
    /// Gain and delay wherever the sources are added to one system; nothing else has them.
    pub change: SourceChange,
}

/// A point receiver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Receiver {
    /// Name, unique among the receivers.
    pub name: String,
    /// Position [m].
    pub position: DVec3,
    /// Unit vector; towards the first source unless stated. The zero vector where no source is known.
    pub aim: DVec3,
    /// Sensitivity about the aim, 1 on it.
    pub pattern: Pattern,
}

impl Source {
    /// An omnidirectional source of 90 dB in each of `band_count` bands.
    pub fn omni(name: &str, position: DVec3, band_count: usize) -> Self {
        Self {
            name: name.to_owned(),
            position,
            power_level_db: vec![DEFAULT_POWER_LEVEL_DB; band_count],
            directivity: Directivity::OMNI,
            aim: DVec3::X,
            change: SourceChange::default(),
        }
    }
}

impl Receiver {
    /// A receiver at `position` [m] that looks at `target` [m]; along x when it stands there.
    pub fn towards(name: &str, position: DVec3, target: DVec3) -> Self {
        let aim = (target - position).normalize_or(DVec3::X);
        Self { name: name.to_owned(), position, aim, pattern: Pattern::Omni }
    }
}

impl Scene {
    /// A closed shoebox with one corner at the origin and one material, no source, no receiver, default air.
    ///
    /// `dimensions` [m], positive; `material` must have a coefficient per band. It lasts 1.2 times its largest Sabine
    /// time, or 1 s when nothing absorbs.
    pub fn shoebox(dimensions: [f64; 3], material: Material, bands: Bands) -> Self {
        let mut scene = Self::from_parts(Mesh::shoebox(dimensions, [0; 6]), vec![material], bands, 1.0);
        let time = scene.geometry().ok().and_then(|geometry| scene.largest_sabine_time(&geometry));
        if let Some(time) = time {
            scene.duration = DURATION_PER_SABINE_TIME * time;
        }
        scene
    }

    /// A scene of any mesh [m] whose triangles index `materials`, lasting `duration` [s]: no source, no receiver,
    /// default air, z up.
    pub fn from_parts(mesh: Mesh, materials: Vec<Material>, bands: Bands, duration: f64) -> Self {
        let air = Air::default();
        Self {
            name: String::new(),
            speed_of_sound: air.speed_of_sound(),
            sound_speed_gradient: 0.0,
            air_attenuation: attenuation_per_band(&air, &bands),
            air,
            bands,
            duration,
            has_default_duration: false,
            materials,
            variants: Vec::new(),
            designs: Vec::new(),
            mesh,
            air_at: Vec::new(),
            sources: Vec::new(),
            receivers: Vec::new(),
            up: DVec3::Z,
            media: None,
            digest: [0; 32],
            mesh_digest: [0; 32],
        }
    }

    /// Materials of the design that is called `name`; none where there is no such design.
    #[must_use]
    pub fn design(&self, name: &str) -> Option<Vec<Material>> {
        let design = self.designs.iter().find(|design| design.name == name)?;
        self.chosen(&design.choices)
    }

    /// The materials with other choices; none where a variant is not there.
    fn chosen(&self, choices: &[(u32, u32)]) -> Option<Vec<Material>> {
        let mut materials = self.materials.clone();
        for &(material, variant) in choices {
            let chosen = self.variants.get(material as usize).and_then(|of| of.get(variant as usize));
            materials[material as usize] = chosen?.clone();
        }
        Some(materials)
    }

    /// Wavelength at the centre of every band [m].
    #[must_use]
    pub fn wavelengths(&self) -> Vec<f64> {
        self.bands.nominal().iter().map(|frequency| self.speed_of_sound / frequency).collect()
    }

    /// Adds an omnidirectional source of 90 dB at `position` [m].
    #[must_use]
    pub fn with_source(mut self, name: &str, position: [f64; 3]) -> Self {
        self.sources.push(Source::omni(name, position.into(), self.bands.count()));
        self
    }

    /// Adds a receiver at `position` [m], aimed at the first source if there is one.
    #[must_use]
    pub fn with_receiver(mut self, name: &str, position: [f64; 3]) -> Self {
        let position = DVec3::from(position);
        let target = self.sources.first().map_or(position, |source| source.position);
        self.receivers.push(Receiver::towards(name, position, target));
        self
    }

    /// The speed of sound about `center`, the middle of the scene ([`Geometry::center`]); none in even air.
    #[must_use]
    pub fn profile(&self, center: DVec3) -> Option<SpeedProfile> {
        let speed = self.speed_of_sound + self.sound_speed_gradient * self.up.dot(center);
        SpeedProfile::new(speed, self.sound_speed_gradient * self.up)
    }

    /// Why the gradient of the speed of sound is impossible in this scene, and what to do; none where it is sound.
    #[must_use]
    pub fn profile_problem(&self, geometry: &Geometry) -> Option<String> {
        let gradient = self.sound_speed_gradient;
        if gradient == 0.0 {
            return None;
        }
        if self.media.is_some() {
            return Some(
                "regions cannot be combined with a gradient of the speed of sound: remove one of the two"
                    .to_owned(),
            );
        }
        if self.materials.iter().any(|material| material.law.is_angular()) {
            let problem = "absorption_law cannot be combined with a gradient of the speed of sound: remove one of the two";
            return Some(problem.to_owned());
        }
        let (low, high) = geometry.bounds();
        let corner = |pick: usize| {
            DVec3::from_array(
                [0, 1, 2].map(|axis| if pick >> axis & 1 == 0 { low[axis] } else { high[axis] }),
            )
        };
        let points = self.sources.iter().map(|source| source.position);
        let points = points.chain(self.receivers.iter().map(|receiver| receiver.position));
        let heights = (0..8).map(corner).chain(points).map(|place| self.up.dot(place));
        let speed = |height: f64| self.speed_of_sound + gradient * height;
        let slowest = heights.min_by(|a, b| speed(*a).total_cmp(&speed(*b)))?;
        if speed(slowest) <= 0.0 {
            return Some(format!(
                "{gradient} 1/s makes the speed of sound {} m/s at the height {} m, where the scene has walls, sources or receivers: \
                 give a gradient with which it stays above 0",
                notation::number(speed(slowest)),
                notation::number(slowest)
            ));
        }
        (gradient.abs() * self.duration > LARGEST_TURN).then(|| {
            format!(
                "{gradient} 1/s over {} s is out of range: gradient times duration is at most {LARGEST_TURN}; lower one of them",
                notation::number(self.duration)
            )
        })
    }

    /// Switches the attenuation of the air off.
    #[must_use]
    pub fn without_air_attenuation(mut self) -> Self {
        self.air_attenuation.fill(0.0);
        self
    }

    /// Replaces the duration [s], which counts as stated.
    #[must_use]
    pub fn with_duration(mut self, duration: f64) -> Self {
        self.duration = duration;
        self.has_default_duration = false;
        self
    }

    /// ρc of the air at the scene's speed of sound [Pa·s/m].
    pub fn impedance(&self) -> f64 {
        self.air.density() * self.speed_of_sound
    }

    /// The ray-casting index of the mesh.
    ///
    /// # Errors
    /// When the mesh has no usable triangle, see [`GeometryError`].
    pub fn geometry(&self) -> Result<Geometry, GeometryError> {
        let is_interface = |material| self.media.as_ref().is_some_and(|media| media.is_interface(material));
        Geometry::with_kinds(
            self.mesh.clone(),
            |material| face_kind(&self.materials, material, is_interface),
            &self.air_at,
        )
    }

    /// Whether faces are walls, partitions and interfaces as in `other`, a scene of the same mesh: then both have one geometry.
    #[must_use]
    pub fn has_faces_of(&self, other: &Self) -> bool {
        let kind = |scene: &Self, material| face_kind(&scene.materials, material, |_| false);
        (0..self.materials.len() as u32).all(|material| kind(self, material) == kind(other, material))
    }

    /// Number of the air at a source, 0 for the scene's.
    #[must_use]
    pub fn air_at_source(&self, source: usize) -> u32 {
        self.media.as_ref().map_or(0, |media| media.at_sources[source])
    }

    /// Travel time over a length in each air, relative to that in the scene's air: c₀/c, first 1 for the scene's own.
    #[must_use]
    pub fn stretches(&self) -> Vec<f64> {
        let regions = self.media.iter().flat_map(|media| &media.regions);
        std::iter::once(1.0)
            .chain(regions.map(|region| self.speed_of_sound / region.speed_of_sound))
            .collect()
    }

    /// ρc of each air [Pa·s/m], first of the scene's own.
    #[must_use]
    pub fn impedances(&self) -> Vec<f64> {
        let regions = self.media.iter().flat_map(|media| &media.regions);
        std::iter::once(self.impedance())
            .chain(regions.map(|region| region.density * region.speed_of_sound))
            .collect()
    }

    /// Sabine's time of the band that rings longest [s], with the variants that absorb least, or `None` when a band has no absorption at all.
    ///
    /// `geometry` is [`Scene::geometry`]. A mesh that is no closed room is given the volume of its bounding box.
    pub fn largest_sabine_time(&self, geometry: &Geometry) -> Option<f64> {
        let least = |material: usize, band: usize| {
            let variants = self.variants.get(material).into_iter().flatten();
            let absorption = variants.map(|variant| variant.absorption[band]);
            absorption.fold(self.materials[material].absorption[band], f64::min)
        };
        let largest = self.sabine_times_with(geometry, least).into_iter().fold(0.0, f64::max);
        (largest.is_finite() && largest > 0.0).then_some(largest)
    }

    /// Default duration [s]: 1.2 times [`Self::largest_sabine_time`], rounded up to hundredths.
    pub fn default_duration(&self, geometry: &Geometry) -> Option<f64> {
        self.largest_sabine_time(geometry).map(default_duration)
    }

    /// Sabine's time of every band [s], infinite without absorption; `geometry` as in [`Scene::largest_sabine_time`].
    pub(crate) fn sabine_times(&self, geometry: &Geometry) -> Vec<f64> {
        self.sabine_times_with(geometry, |material, band| self.materials[material].absorption[band])
    }

    /// The same with other absorption by material and band.
    fn sabine_times_with(&self, geometry: &Geometry, absorption: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let volume = geometry.volume().unwrap_or_else(|| {
            let (lowest, highest) = geometry.bounds();
            (highest - lowest).element_product()
        });
        let areas: Vec<f64> = (0u32..).take(self.materials.len()).map(|m| geometry.exposed_area(m)).collect();
        let time = |band: usize| {
            let walls = areas.iter().enumerate().map(|(material, area)| (*area, absorption(material, band)));
            sabine_time(
                volume,
                equivalent_absorption_area(walls),
                self.air_attenuation[band],
                self.speed_of_sound,
            )
        };
        (0..self.bands.count()).map(time).collect()
    }
}

/// The default for this largest Sabine time [s].
pub(crate) fn default_duration(sabine: f64) -> f64 {
    libm::ceil(100.0 * DURATION_PER_SABINE_TIME * sabine) / 100.0
}

/// The material of interfaces as estimators of straight paths see it: nothing comes through or back.
pub(crate) fn opaque(name: &str, bands: usize) -> Material {
    Material::uniform(name, 1.0, 0.0, bands)
}

/// m per band at the exact midbands [1/m].
pub(crate) fn attenuation_per_band(air: &Air, bands: &Bands) -> Vec<f64> {
    (0..bands.count()).map(|band| air.energy_attenuation(bands.exact_midband(band))).collect()
}

/// Kind of the faces of a material.
pub(crate) fn face_kind(
    materials: &[Material],
    material: u32,
    is_interface: impl Fn(u32) -> bool,
) -> FaceKind {
    if is_interface(material) {
        FaceKind::Interface
    } else if materials.get(material as usize).is_some_and(Material::transmits) {
        FaceKind::Partition
    } else {
        FaceKind::Wall
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    fn shoebox() -> Scene {
        let bands = Bands::octaves();
        Scene::shoebox([10.0, 7.0, 3.0], Material::uniform("walls", 0.2, 0.5, bands.count()), bands)
            .with_source("source", [2.0, 2.0, 1.5])
            .with_receiver("receiver", [7.0, 2.0, 1.5])
    }

    #[test]
    fn builders_fill_every_band() {
        let scene = shoebox();
        assert_eq!((scene.air_attenuation.len(), scene.sources[0].power_level_db.len()), (8, 8));
        assert!(scene.geometry().unwrap().is_closed_room());
        assert_eq!(scene.receivers[0].aim, dvec3(-1.0, 0.0, 0.0));
        let still = scene.without_air_attenuation().with_duration(3.0);
        assert!(
            still.air_attenuation.iter().all(|m| m.abs() < 1e-300) && (still.duration - 3.0).abs() < 1e-12
        );
    }

    #[test]
    fn shoebox_lasts_longer_than_it_rings() {
        let scene = shoebox();
        let time = sabine_time(210.0, 0.2 * 242.0, scene.air_attenuation[0], scene.speed_of_sound);
        assert!((scene.duration - 1.2 * time).abs() < 1e-9);
    }

    #[test]
    fn silent_walls_have_no_sabine_time() {
        let mut scene = shoebox().without_air_attenuation();
        scene.materials[0].absorption[3] = 0.0;
        assert_eq!(scene.largest_sabine_time(&scene.geometry().unwrap()), None);
    }

    #[test]
    fn serialised_form_carries_all_but_the_mesh() {
        let scene = shoebox();
        let mut read: Scene = toml::from_str(&toml::to_string(&scene).unwrap()).unwrap();
        assert_eq!(read.mesh, Mesh::default());
        read.mesh = scene.mesh.clone();
        assert_eq!(read, scene);
    }
}
