//! The command that traces a map for materials that another map does not carry.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::study::room_decay;
use sonel_acoustics::Material;
use sonel_geometry::Geometry;
use sonel_map::{MapHeader, Settings, Spectral};
use sonel_scene::{Scene, shell_word};

/// A call of `sonel-trace` with the settings of `header`, for its variants and for its materials where they are others than the map was
/// `drawn_with`. The map of this `label` is replaced; the scene file is not known. `geometry` is that of the scene.
pub(super) fn command(
    header: &MapHeader,
    drawn_with: Option<&[Material]>,
    geometry: &Geometry,
    label: &str,
) -> String {
    let drawn_with = drawn_with.unwrap_or(&header.scene.materials);
    let mut command = format!("sonel-trace SCENE.toml -o {}", shell_word(label));
    let (Settings { emissions, seed, batches, survival, spectral, .. }, default) =
        (header.settings, Settings::default());
    let numbers = [
        ("packets", emissions.to_string(), emissions == default.emissions),
        ("seed", seed.to_string(), seed == default.seed),
        ("batches", batches.to_string(), batches == default.batches),
        ("survival", survival.to_string(), survival.to_bits() == default.survival.to_bits()),
        ("spectral", spectral.name().to_owned(), spectral == Spectral::Shared),
    ];
    for (option, value, _) in numbers.into_iter().filter(|(.., is_default)| !is_default) {
        let _ = write!(command, " --{option} {value}");
    }
    if let Some(duration) = longer(&header.scene, drawn_with, geometry) {
        let _ = write!(command, " --duration {duration}");
    }
    for option in options(header, drawn_with) {
        let _ = write!(command, " --for {}", shell_word(&option));
    }
    command
}

/// The duration that the materials take [s], where the map has a shorter one: as a trace finds it whose scene states none.
fn longer(scene: &Scene, drawn_with: &[Material], geometry: &Geometry) -> Option<f64> {
    let drawn = Scene { materials: drawn_with.to_vec(), ..scene.clone() };
    if drawn.default_duration(geometry)?.to_bits() == scene.duration.to_bits() {
        return None;
    }
    let mut needed =
        Scene { duration: scene.default_duration(geometry)?, has_default_duration: true, ..scene.clone() };
    // A room that cannot be traced has a message of its own.
    room_decay::lengthen(&mut needed, geometry).ok()?;
    Some(needed.duration).filter(|&duration| duration > scene.duration)
}

/// What every `--for` says.
fn options(header: &MapHeader, drawn_with: &[Material]) -> Vec<String> {
    let scene = &header.scene;
    let mut options = Vec::new();
    for (index, (drawn, changed)) in drawn_with.iter().zip(&scene.materials).enumerate() {
        let mut values = BTreeMap::<&str, Vec<String>>::new();
        for other in scene.variants.get(index).into_iter().flatten().chain([changed]) {
            let keys = [
                ("absorption", &other.absorption, &drawn.absorption),
                ("scattering", &other.scattering, &drawn.scattering),
                ("transmission", &other.transmission, &drawn.transmission),
            ];
            for (key, value, own) in keys {
                let (value, known) = (in_words(value), values.entry(key).or_default());
                if value != in_words(own) && !known.contains(&value) {
                    known.push(value);
                }
            }
        }
        let named = values.into_iter().filter(|(_, values)| !values.is_empty());
        options.extend(
            named.map(|(key, values)| format!("materials.{}.{key}={}", drawn.name, values.join(","))),
        );
    }
    options
}

/// One number where all bands are equal, else a list.
fn in_words(values: &[f64]) -> String {
    match values {
        [first, rest @ ..] if rest.iter().all(|value| value.to_bits() == first.to_bits()) => {
            first.to_string()
        }
        _ => format!("[{}]", values.iter().map(f64::to_string).collect::<Vec<_>>().join(",")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::Bands;
    use sonel_geometry::Mesh;
    use sonel_map::ShardRange;

    #[test]
    fn the_command_names_changes_and_variants() {
        let walls = Material::uniform("old walls", 0.2, 0.5, 8);
        let mut scene = Scene::shoebox([3.0, 4.0, 5.0], walls.clone(), Bands::octaves())
            .with_source("source", [1.0, 1.0, 1.0]);
        scene.variants = vec![vec![Material::uniform("old walls", 0.9, 0.5, 8)]];
        let settings = Settings { emissions: 5000, ..Settings::default() };
        let mut header = MapHeader {
            tool_version: String::new(),
            settings,
            shard: ShardRange::WHOLE,
            effects: Vec::new(),
            scene,
        };
        let geometry = header.scene.geometry().unwrap();
        header.scene.duration = header.scene.default_duration(&geometry).unwrap();
        header.scene.materials[0].scattering[7] = 0.25;
        let command = |header: &MapHeader| {
            command(header, Some(std::slice::from_ref(&walls)), &geometry, "a/hall.sonelmap")
        };
        assert_eq!(
            command(&header),
            "sonel-trace SCENE.toml -o a/hall.sonelmap --packets 5000 --for 'materials.old walls.absorption=0.9' \
             --for 'materials.old walls.scattering=[0.5,0.5,0.5,0.5,0.5,0.5,0.5,0.25]'"
        );
        // A duration that the scene states is too short for walls that absorb less.
        header.scene.duration = 0.1;
        header.scene.materials[0].absorption = vec![0.05; 8];
        let sabine = header.scene.default_duration(&geometry).unwrap();
        let stated = duration(&command(&header));
        assert!((stated / sabine - 1.0).abs() < 0.2, "{stated} {sabine}");
    }

    fn duration(command: &str) -> f64 {
        let (_, duration) = command.split_once(" --duration ").expect("a longer run");
        duration.split(' ').next().unwrap().parse().unwrap()
    }

    /// Sound between hard walls outlives Sabine's time where the ceiling alone absorbs.
    #[test]
    fn a_room_that_would_decay_slowly_is_traced_for_longer_than_sabine_says() {
        let material = |absorption| Material::uniform("side", absorption, 0.05, 8);
        let drawn = [material(0.3), material(0.9)];
        let mesh = Mesh::shoebox([7.0, 5.0, 3.0], [0, 0, 0, 0, 0, 1]);
        let changed = vec![material(0.03), material(0.9)];
        let scene =
            Scene::from_parts(mesh, changed, Bands::octaves(), 0.5).with_source("source", [1.7, 1.4, 1.5]);
        let geometry = scene.geometry().unwrap();
        let sabine = scene.default_duration(&geometry).unwrap();
        let needed = longer(&scene, &drawn, &geometry).unwrap();
        assert!(needed > 1.3 * sabine, "{needed} {sabine}");
    }
}
