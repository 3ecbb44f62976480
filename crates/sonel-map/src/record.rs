//! Scene and settings as plain records, and back.

use glam::DVec3;
use sonel_acoustics::{AbsorptionLaw, Air, BandWidth, Bands, Directivity, Material, Pattern, SourceChange};
use sonel_geometry::{Mesh, MeshTriangle};
use sonel_scene::{Effect, Receiver, Scene, Source};

use crate::codec::{
    DirectivityRecord, EffectRecord, HeaderRecord, MaterialRecord, ReceiverRecord, SceneRecord,
    SectionRecord, SettingsRecord, SourceRecord,
};
use crate::directivity;
use crate::emission::CHUNK_EMISSIONS;
use crate::header::{EffectState, MapHeader, Mode, Settings, ShardRange};
use crate::spectral::Spectral;

/// More batches than any interval needs; readers hold sums for each.
const LARGEST_BATCH_COUNT: u32 = 1 << 16;

/// Vertices as f64 triples and triangles as (corner, corner, corner, material).
pub(crate) fn mesh_columns(mesh: &Mesh) -> (Vec<[f64; 3]>, Vec<[u32; 4]>) {
    let vertices = mesh.vertices.iter().map(DVec3::to_array).collect();
    let triangles = mesh
        .triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.corners;
            [a, b, c, triangle.material]
        })
        .collect();
    (vertices, triangles)
}

/// The mesh of columns written by [`mesh_columns`].
pub(crate) fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 4]]) -> Mesh {
    Mesh {
        vertices: vertices.iter().copied().map(DVec3::from_array).collect(),
        triangles: triangles
            .iter()
            .map(|&[a, b, c, material]| MeshTriangle { corners: [a, b, c], material })
            .collect(),
    }
}

pub(crate) fn header_record(header: &MapHeader, center: DVec3, sections: Vec<SectionRecord>) -> HeaderRecord {
    let chunk_bytes =
        sections.iter().find(|section| section.name == "chunks").map_or(0, |section| section.length);
    let settings = &header.settings;
    HeaderRecord {
        tool_version: header.tool_version.clone(),
        settings: SettingsRecord {
            emissions: settings.emissions,
            seed: settings.seed,
            batches: settings.batches,
            spectral: u32::from(settings.spectral == Spectral::PerBand),
            mode: u32::from(settings.mode == Mode::Paper),
            shard_index: header.shard.index,
            shard_count: header.shard.count,
            chunk_emissions: CHUNK_EMISSIONS,
            survival: settings.survival,
        },
        effects: header.effects.iter().map(effect_record).collect(),
        scene: scene_record(&header.scene),
        center: center.to_array(),
        chunk_count: chunk_bytes / size_of::<crate::format::ChunkEntry>() as u64,
        sections,
    }
}

fn effect_record(effect: &EffectState) -> EffectRecord {
    EffectRecord {
        name: effect.effect.name().to_owned(),
        on: effect.on.iter().copied().map(u8::from).collect(),
        reason: effect.reason.clone(),
    }
}

fn effect(record: EffectRecord) -> Result<EffectState, String> {
    let EffectRecord { name, on, reason } = record;
    let effect =
        Effect::named(&name).ok_or_else(|| format!("effect \"{name}\" is unknown to this version"))?;
    Ok(EffectState { effect, on: on.iter().map(|&on| on != 0).collect(), reason })
}

fn scene_record(scene: &Scene) -> SceneRecord {
    SceneRecord {
        name: scene.name.clone(),
        up: scene.up.to_array(),
        third_octaves: u8::from(scene.bands.width() == BandWidth::Third),
        nominal_frequencies: scene.bands.nominal().to_vec(),
        air: air_record(&scene.air),
        speed_of_sound: scene.speed_of_sound,
        air_attenuation: scene.air_attenuation.clone(),
        duration: scene.duration,
        scene_digest: scene.digest,
        mesh_digest: scene.mesh_digest,
        materials: scene.materials.iter().map(material_record).collect(),
        sources: scene.sources.iter().map(source_record).collect(),
        receivers: scene.receivers.iter().map(receiver_record).collect(),
    }
}

pub(crate) fn air_record(air: &Air) -> [f64; 3] {
    [air.temperature_celsius, air.relative_humidity_percent, air.pressure_kpa]
}

pub(crate) fn air([temperature_celsius, relative_humidity_percent, pressure_kpa]: [f64; 3]) -> Air {
    Air { temperature_celsius, relative_humidity_percent, pressure_kpa }
}

pub(crate) fn material_record(material: &Material) -> MaterialRecord {
    MaterialRecord {
        name: material.name.clone(),
        absorption: material.absorption.clone(),
        scattering: material.scattering.clone(),
        transmission: material.transmission.clone(),
        source: material.source.clone().unwrap_or_default(),
    }
}

fn source_record(source: &Source) -> SourceRecord {
    SourceRecord {
        name: source.name.clone(),
        position: source.position.to_array(),
        power_level_db: source.power_level_db.clone(),
        directivity: directivity::word(&source.directivity).to_owned(),
        aim: source.aim.to_array(),
    }
}

fn receiver_record(receiver: &Receiver) -> ReceiverRecord {
    ReceiverRecord {
        name: receiver.name.clone(),
        position: receiver.position.to_array(),
        aim: receiver.aim.to_array(),
    }
}

/// Name of the section that only a map with materials of another law than [`AbsorptionLaw::Uniform`] has: a code per material.
pub(crate) const LAWS: &str = "absorption.laws";

/// The rows of [`LAWS`]; none where all are uniform.
pub(crate) fn laws(materials: &[Material]) -> Option<Vec<u8>> {
    let is_angular = materials.iter().any(|material| material.law.is_angular());
    is_angular.then(|| materials.iter().map(|material| material.law.code()).collect())
}

/// Name of the section that only a map of a scene with gains or delays of its sources has: gain [dB] and delay [s] of each.
pub(crate) const CHANGES: &str = "sources.changes";

/// The rows of [`CHANGES`]; none where no source has a gain or delay.
pub(crate) fn changes(sources: &[Source]) -> Option<Vec<[f64; 2]>> {
    let row = |source: &Source| [source.change.gain_db, source.change.delay];
    sources.iter().any(|source| !source.change.is_none()).then(|| sources.iter().map(row).collect())
}

/// Gives the `rows` of [`CHANGES`], none without the section, to `sources`; the reason where they are of others or out of range.
pub(crate) fn apply_changes(rows: &[[f64; 2]], sources: &mut [Source]) -> Result<(), String> {
    if !rows.is_empty() && rows.len() != sources.len() {
        return Err("not one gain and delay per source".to_owned());
    }
    for (source, &[gain_db, delay]) in sources.iter_mut().zip(rows) {
        source.change = SourceChange { gain_db, delay };
        if !source.change.is_valid() {
            return Err(format!("gain or delay of source {} out of range", source.name));
        }
    }
    Ok(())
}

/// Name of the section that only a map of a scene with `air_at` has: its places [m].
pub(crate) const AIR_AT: &str = "air_at";

/// The rows of [`AIR_AT`]; none where no place is stated.
pub(crate) fn air_at(places: &[DVec3]) -> Option<Vec<[f64; 3]>> {
    (!places.is_empty()).then(|| places.iter().map(DVec3::to_array).collect())
}

/// The places in the `rows` of [`AIR_AT`], none without the section; the reason where one is not finite.
pub(crate) fn read_air_at(rows: &[[f64; 3]]) -> Result<Vec<DVec3>, String> {
    let places: Vec<DVec3> = rows.iter().copied().map(DVec3::from_array).collect();
    if places.iter().all(|place| place.is_finite()) {
        Ok(places)
    } else {
        Err("a place of air is not finite".to_owned())
    }
}

/// The header of `record` with the scene's `mesh`, its directivities and the rows of [`LAWS`], none where there are none; the reason
/// where the record contradicts itself.
pub(crate) fn header(
    record: HeaderRecord,
    mesh: Mesh,
    directivity: Option<DirectivityRecord>,
    laws: &[u8],
) -> Result<MapHeader, String> {
    let settings = settings(&record.settings)?;
    let shard = ShardRange { index: record.settings.shard_index, count: record.settings.shard_count };
    if shard.index == 0 || shard.index > shard.count {
        return Err(format!("shard {} of {} does not exist", shard.index, shard.count));
    }
    let effects = record.effects.into_iter().map(effect).collect::<Result<_, _>>()?;
    let words: Vec<String> = record.scene.sources.iter().map(|source| source.directivity.clone()).collect();
    let mut scene = scene(record.scene, mesh, laws)?;
    directivity::apply(&words, directivity, &mut scene)?;
    Ok(MapHeader { tool_version: record.tool_version, settings, shard, effects, scene })
}

fn settings(record: &SettingsRecord) -> Result<Settings, String> {
    if record.chunk_emissions != CHUNK_EMISSIONS {
        return Err(format!("chunks of {} emissions are unknown to this version", record.chunk_emissions));
    }
    if record.batches == 0 || record.batches > LARGEST_BATCH_COUNT {
        return Err(format!("{} batches; 1 to {LARGEST_BATCH_COUNT} are possible", record.batches));
    }
    if record.spectral > 1 || record.mode > 1 {
        return Err("the settings hold a code that this version does not know".to_owned());
    }
    if !(0.0..=1.0).contains(&record.survival) {
        return Err("survival exponent out of range".to_owned());
    }
    Ok(Settings {
        emissions: record.emissions,
        seed: record.seed,
        batches: record.batches,
        survival: record.survival,
        spectral: if record.spectral == 1 { Spectral::PerBand } else { Spectral::Shared },
        mode: if record.mode == 1 { Mode::Paper } else { Mode::Accurate },
    })
}

fn scene(record: SceneRecord, mesh: Mesh, laws: &[u8]) -> Result<Scene, String> {
    let width = if record.third_octaves == 1 { BandWidth::Third } else { BandWidth::Octave };
    let bands = Bands::new(record.nominal_frequencies, width).map_err(|problem| problem.to_string())?;
    let expected = bands.count();
    let mut materials: Vec<Material> = record.materials.into_iter().map(material).collect();
    let problem = "not one law of absorption per material";
    if !laws.is_empty() && laws.len() != materials.len() {
        return Err(problem.to_owned());
    }
    for (material, &code) in materials.iter_mut().zip(laws) {
        material.law = AbsorptionLaw::of_code(code).ok_or(problem)?;
    }
    for material in &materials {
        if let Some(problem) = material.problems(expected).first() {
            return Err(format!("material {}: {problem}", material.name));
        }
    }
    let attenuation = &record.air_attenuation;
    if attenuation.len() != expected || !attenuation.iter().all(|m| (0.0..f64::INFINITY).contains(m)) {
        return Err("not one attenuation by air per band".to_owned());
    }
    if !is_positive(record.duration) || !is_positive(record.speed_of_sound) {
        return Err("duration or speed of sound out of range".to_owned());
    }
    let corner_count = mesh.vertices.len() as u32;
    let sound = |triangle: &MeshTriangle| {
        triangle.corners.iter().all(|&corner| corner < corner_count)
            && (triangle.material as usize) < materials.len()
    };
    if !mesh.triangles.iter().all(sound) || !mesh.vertices.iter().all(|vertex| vertex.is_finite()) {
        return Err("the mesh names corners or materials that do not exist".to_owned());
    }
    Ok(Scene {
        name: record.name,
        up: DVec3::from_array(record.up),
        air: air(record.air),
        speed_of_sound: record.speed_of_sound,
        air_attenuation: record.air_attenuation,
        sources: record.sources.into_iter().map(|s| source(s, expected)).collect::<Result<_, _>>()?,
        receivers: record.receivers.into_iter().map(receiver).collect::<Result<_, _>>()?,
        digest: record.scene_digest,
        mesh_digest: record.mesh_digest,
        ..Scene::from_parts(mesh, materials, bands, record.duration)
    })
}

pub(crate) fn material(record: MaterialRecord) -> Material {
    Material {
        name: record.name,
        absorption: record.absorption,
        scattering: record.scattering,
        transmission: record.transmission,
        law: AbsorptionLaw::Uniform,
        source: Some(record.source).filter(|source| !source.is_empty()),
    }
}

fn source(record: SourceRecord, bands: usize) -> Result<Source, String> {
    let (position, aim) = (DVec3::from_array(record.position), DVec3::from_array(record.aim));
    let is_unit = (aim.length_squared() - 1.0).abs() <= directivity::ORTHONORMAL;
    if !position.is_finite() || !is_unit {
        return Err(format!("source {} has no finite position or no unit aim", record.name));
    }
    if record.power_level_db.len() != bands || !record.power_level_db.iter().all(|level| level.is_finite()) {
        return Err(format!("source {} has not one power level per band", record.name));
    }
    Ok(Source {
        directivity: Directivity::OMNI,
        name: record.name,
        position,
        power_level_db: record.power_level_db,
        aim,
        change: SourceChange::default(),
    })
}

fn receiver(record: ReceiverRecord) -> Result<Receiver, String> {
    let (position, aim) = (DVec3::from_array(record.position), DVec3::from_array(record.aim));
    if !position.is_finite() || !aim.is_finite() {
        return Err(format!("receiver {} has no finite position or aim", record.name));
    }
    Ok(Receiver { name: record.name, position, aim, pattern: Pattern::Omni })
}

fn is_positive(value: f64) -> bool {
    value.is_finite() && value > 0.0
}
