//! Differences between the provenance of two maps: scene, settings, effects, program; shard numbers are ignored.
//!
//! Numbers are written so that different ones look different, and compared as written.

use sonel_acoustics::{Directivity, Material};
use sonel_scene::{Receiver, Region, Scene, Source};

use crate::header::{EffectState, MapHeader};
use crate::record;

/// One thing in which two maps differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Quantity, such as `seed` or `absorption of material "felt"`.
    pub what: String,
    /// Value in the one map.
    pub here: String,
    /// Value in the other map.
    pub there: String,
}

/// A thing and what a map says of it.
type Fact = (String, String);

/// Value of a quantity that only the other map has.
const NOTHING: &str = "nothing";

/// Everything in which `here` and `there` differ, but for their shards. Maps with other bands have other lists per band as
/// well, which is not said again.
#[must_use]
pub fn differences(here: &MapHeader, there: &MapHeader) -> Vec<Difference> {
    let mut found = compare(&facts(here), &facts(there));
    if here.scene.bands == there.scene.bands {
        found.extend(compare(&facts_per_band(here), &facts_per_band(there)));
    }
    found
}

fn compare(here: &[Fact], there: &[Fact]) -> Vec<Difference> {
    let said = |facts: &[Fact], what: &str| {
        let fact = facts.iter().find(|(name, _)| name == what);
        fact.map_or_else(|| NOTHING.to_owned(), |(_, value)| value.clone())
    };
    let only_there = there.iter().filter(|(what, _)| !here.iter().any(|(name, _)| name == what));
    here.iter()
        .chain(only_there)
        .map(|(what, _)| Difference { what: what.clone(), here: said(here, what), there: said(there, what) })
        .filter(|difference| difference.here != difference.there)
        .collect()
}

fn facts(header: &MapHeader) -> Vec<Fact> {
    let (settings, scene) = (&header.settings, &header.scene);
    let plain = [
        ("version of sonel", header.tool_version.clone()),
        ("scene file (its digest)", hexadecimal(&scene.digest)),
        ("mesh file (its digest)", hexadecimal(&scene.mesh_digest)),
        ("mesh", mesh(scene)),
        ("name of the scene", scene.name.clone()),
        ("bands", format!("{} of {} Hz", scene.bands.width(), numbers(scene.bands.nominal()))),
        ("upward direction", numbers(&scene.up.to_array())),
        ("temperature [°C]", scene.air.temperature_celsius.to_string()),
        ("relative humidity [%]", scene.air.relative_humidity_percent.to_string()),
        ("air pressure [kPa]", scene.air.pressure_kpa.to_string()),
        ("speed of sound [m/s]", scene.speed_of_sound.to_string()),
        ("duration [s]", scene.duration.to_string()),
        ("number of emissions", settings.emissions.to_string()),
        ("seed", settings.seed.to_string()),
        ("number of batches", settings.batches.to_string()),
        ("survival exponent", settings.survival.to_string()),
        ("spectral", settings.spectral.name().to_owned()),
        ("mode", settings.mode.name().to_owned()),
        ("order of the materials", names(scene.materials.iter().map(|material| &material.name))),
        ("order of the sources", names(scene.sources.iter().map(|source| &source.name))),
        ("order of the receivers", names(scene.receivers.iter().map(|receiver| &receiver.name))),
    ];
    let mut facts: Vec<Fact> = plain.into_iter().map(|(what, value)| (what.to_owned(), value)).collect();
    facts.extend(scene.receivers.iter().map(receiver));
    if scene.sound_speed_gradient != 0.0 {
        let gradient = scene.sound_speed_gradient.to_string();
        facts.push(("gradient of the speed of sound [1/s]".to_owned(), gradient));
    }
    facts.extend(scene.media.iter().map(|media| {
        let airs = media.regions.iter().map(|region| {
            let Region { name, inside, speed_of_sound, density, .. } = region;
            format!("{name} about {inside} m: {speed_of_sound} m/s, {density} kg/m³")
        });
        let interfaces = media.interfaces.iter().map(|&interface| &scene.materials[interface as usize].name);
        let airs = airs.collect::<Vec<_>>().join("; ");
        ("regions of other air".to_owned(), format!("{airs}; behind {}", names(interfaces)))
    }));
    facts
}

fn facts_per_band(header: &MapHeader) -> Vec<Fact> {
    let scene = &header.scene;
    let air = ("attenuation by air [1/m]".to_owned(), numbers(&scene.air_attenuation));
    let effects = header.effects.iter().map(effect);
    let materials = scene.materials.iter().flat_map(material);
    let variants = scene.materials.iter().zip(&scene.variants).filter(|(_, variants)| !variants.is_empty());
    let variants = variants.map(|(material, variants)| self::variants(&material.name, variants));
    let sources = scene.sources.iter().map(source);
    let regions = scene.media.iter().flat_map(|media| &media.regions).map(|region| {
        (format!("attenuation by air of region \"{}\" [1/m]", region.name), numbers(&region.air_attenuation))
    });
    let designs = scene.designs.iter().map(|design| {
        let of = |&(material, variant): &(u32, u32)| {
            format!("variant {variant} of \"{}\"", scene.materials[material as usize].name)
        };
        let choices: Vec<String> = design.choices.iter().map(of).collect();
        (format!("variant \"{}\"", design.name), choices.join("; "))
    });
    let materials = materials.chain(variants).chain(designs);
    effects.chain([air]).chain(regions).chain(materials).chain(sources).collect()
}

fn mesh(scene: &Scene) -> String {
    let (corners, triangles) = record::mesh_columns(&scene.mesh);
    let mut hasher = blake3::Hasher::new();
    hasher.update(bytemuck::cast_slice(&corners)).update(bytemuck::cast_slice(&triangles));
    format!("{} triangles with digest {}", triangles.len(), hexadecimal(hasher.finalize().as_bytes()))
}

fn effect(effect: &EffectState) -> Fact {
    let on: Vec<&str> = effect.on.iter().map(|&on| if on { "on" } else { "off" }).collect();
    (format!("effect {}", effect.effect.name()), format!("{} ({})", on.join(", "), effect.reason))
}

fn material(material: &Material) -> [Fact; 5] {
    let of = |what: &str, value: String| (format!("{what} of material \"{}\"", material.name), value);
    [
        of("absorption", numbers(&material.absorption)),
        of("scattering", numbers(&material.scattering)),
        of("transmission", numbers(&material.transmission)),
        of("absorption law", material.law.to_string()),
        of("origin", material.source.clone().unwrap_or_default()),
    ]
}

fn variants(name: &str, variants: &[Material]) -> Fact {
    let of = |variant: &Material| {
        let Material { absorption, scattering, transmission, .. } = variant;
        let [absorption, scattering, transmission] =
            [absorption, scattering, transmission].map(|list| numbers(list));
        format!("absorption {absorption}, scattering {scattering}, transmission {transmission}")
    };
    let all: Vec<String> = variants.iter().map(of).collect();
    (format!("variants of material \"{name}\""), all.join("; "))
}

fn source(source: &Source) -> Fact {
    let mut value = format!(
        "{} at ({}) m towards ({}), {} dB",
        directivity(&source.directivity),
        numbers(&source.position.to_array()),
        numbers(&source.aim.to_array()),
        numbers(&source.power_level_db)
    );
    if !source.change.is_none() {
        value += &format!(", gain {} dB, delay {} s", source.change.gain_db, source.change.delay);
    }
    (format!("source \"{}\"", source.name), value)
}

fn directivity(directivity: &Directivity) -> String {
    match directivity {
        Directivity::Pattern(pattern) => pattern.to_string(),
        Directivity::Measured { balloon, up } => {
            let digest = blake3::hash(bytemuck::cast_slice(balloon.factors()));
            let up = numbers(&up.to_array());
            format!("{} with digest {}, upwards ({up})", balloon.name(), hexadecimal(digest.as_bytes()))
        }
    }
}

fn receiver(receiver: &Receiver) -> Fact {
    let (position, aim) = (receiver.position.to_array(), receiver.aim.to_array());
    (
        format!("receiver \"{}\"", receiver.name),
        format!("{} at ({}) m towards ({})", receiver.pattern, numbers(&position), numbers(&aim)),
    )
}

fn names<'a>(names: impl Iterator<Item = &'a String>) -> String {
    names.map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}

fn numbers(values: &[f64]) -> String {
    values.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// A digest as it is written.
#[must_use]
pub fn hexadecimal(digest: &[u8; 32]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::header::{Mode, Settings, ShardRange};
    use crate::spectral::Spectral;
    use glam::DVec3;
    use sonel_acoustics::{BandWidth, Bands};
    use sonel_geometry::Mesh;

    fn header() -> MapHeader {
        let bands = Bands::new(vec![500.0, 1000.0], BandWidth::Octave).unwrap();
        let wall = Material {
            name: "felt".to_owned(),
            absorption: vec![0.1, 0.3],
            scattering: vec![0.5; 2],
            transmission: vec![0.0; 2],
            law: sonel_acoustics::AbsorptionLaw::Uniform,
            source: None,
        };
        let mut scene = Scene::from_parts(Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]), vec![wall], bands, 0.5);
        scene.sources.push(Source::omni("left", DVec3::ONE, 2));
        let effect = EffectState {
            effect: sonel_scene::Effect::Air,
            on: vec![true; 2],
            reason: "asked for".to_owned(),
        };
        MapHeader {
            tool_version: "1.2.3".to_owned(),
            settings: Settings::default(),
            shard: ShardRange::WHOLE,
            effects: vec![effect],
            scene,
        }
    }

    #[test]
    fn a_header_does_not_differ_from_itself_whatever_its_shard() {
        let shard = MapHeader { shard: ShardRange { index: 2, count: 3 }, ..header() };
        assert_eq!(differences(&header(), &shard), []);
    }

    #[test]
    fn every_change_is_named_with_both_values() {
        type Change = fn(&mut MapHeader);
        let changes: [(Change, &str, &str, &str); 18] = [
            (|header| header.tool_version.push('4'), "version of sonel", "1.2.3", "1.2.34"),
            (|header| header.settings.emissions = 7, "number of emissions", "16000", "7"),
            (|header| header.settings.seed = 2, "seed", "1", "2"),
            (|header| header.settings.batches = 8, "number of batches", "32", "8"),
            (|header| header.settings.survival = 0.25, "survival exponent", "0.15", "0.25"),
            (|header| header.settings.spectral = Spectral::PerBand, "spectral", "shared", "per-band"),
            (|header| header.settings.mode = Mode::Paper, "mode", "accurate", "paper"),
            (|header| header.scene.duration = 0.75, "duration [s]", "0.5", "0.75"),
            (|header| header.scene.name = "hut".to_owned(), "name of the scene", "", "hut"),
            (|header| header.scene.digest = [0xab; 32], "scene file", "0000", "abab"),
            (|header| header.scene.mesh_digest = [0xcd; 32], "mesh file", "0000", "cdcd"),
            (|header| header.scene.mesh.vertices[0].x -= 0.5, "mesh", "12 triangles", "12 triangles"),
            (|header| header.scene.air_attenuation[1] = 0.5, "attenuation by air", ", ", ", 0.5"),
            (
                |header| header.scene.sources[0].position.z = 2.5,
                "source \"left\"",
                "(1, 1, 1)",
                "(1, 1, 2.5)",
            ),
            (
                |header| header.scene.sources[0].change.delay = 0.02,
                "source \"left\"",
                "90 dB",
                "delay 0.02 s",
            ),
            (
                |header| header.scene.materials[0].absorption[1] = 0.25,
                "absorption of material \"felt\"",
                "0.1, 0.3",
                "0.1, 0.25",
            ),
            (
                |header| header.scene.variants = vec![vec![Material::uniform("felt", 0.75, 0.5, 2)]],
                "variants of material \"felt\"",
                NOTHING,
                "absorption 0.75, 0.75, scattering",
            ),
            (|header| header.effects[0].on[1] = false, "effect air", "on, on", "on, off"),
        ];
        for (change, what, here, there) in changes {
            let mut other = header();
            change(&mut other);
            let found = differences(&header(), &other);
            assert_eq!(found.len(), 1, "{what}: {found:?}");
            let [found] = &found[..] else { unreachable!() };
            assert!(
                found.what.starts_with(what) && found.here.contains(here) && found.there.contains(there),
                "{found:?}"
            );
        }
    }

    #[test]
    fn what_only_one_map_has_differs_from_nothing() {
        let mut other = header();
        other.effects.clear();
        let found = differences(&other, &header());
        assert_eq!((found.len(), found[0].here.as_str(), found[0].what.as_str()), (1, NOTHING, "effect air"));
    }

    #[test]
    fn other_bands_are_one_difference() {
        let mut other = header();
        other.scene.bands = Bands::new(vec![500.0, 1000.0, 2000.0], BandWidth::Octave).unwrap();
        other.scene.materials[0].absorption.push(0.5);
        other.scene.air_attenuation.push(0.5);
        let found = differences(&header(), &other);
        assert_eq!((found.len(), found[0].what.as_str()), (1, "bands"), "{found:?}");
        assert_eq!(found[0].there, "octave of 500, 1000, 2000 Hz");
    }
}
