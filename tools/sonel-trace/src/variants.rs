//! `--for`: other materials that a map shall carry besides those of the scene.

use std::collections::BTreeMap;

use anyhow::{Context, bail, ensure};
use sonel_geometry::Geometry;
use sonel_map::leads::{MOST_SETS, set_count};
use sonel_scene::{LONGEST_DEFAULT_DURATION, Scene, load_variants};

/// Keys of a material that may have other values.
const KEYS: [&str; 5] = ["absorption", "scattering", "diffuse", "transmission", "sound_reduction_db"];
/// The key that takes entries of the library.
const LIBRARY: &str = "library";

/// One `--for`: a material, one of its keys and the values as TOML.
#[derive(Debug, Clone, PartialEq)]
pub struct Alternatives {
    /// As it was written.
    text: String,
    material: String,
    key: &'static str,
    values: Vec<String>,
}

impl Alternatives {
    /// Reads `materials.NAME.KEY=VALUE,…`, an absorption also as LOW:HIGH, values per band in brackets; or `materials.NAME=ENTRY,…`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "\"{text}\" names no variants: write materials.NAME.absorption=0.02,0.9 (or a range 0.02:0.9, or [0.1,0.2,…] per band; also {}), or materials.NAME=ENTRY,ENTRY of the library",
                KEYS[1..].join(", ")
            )
        };
        let (path, values) = text.split_once('=').ok_or_else(wrong)?;
        let path = path.trim().strip_prefix("materials.").ok_or_else(wrong)?;
        let key_of = |path: &str| {
            let (name, key) = path.rsplit_once('.')?;
            Some((name.to_owned(), *KEYS.iter().find(|known| **known == key)?))
        };
        let (name, key) = key_of(path).unwrap_or_else(|| (path.to_owned(), LIBRARY));
        let values = parts(values).into_iter().map(|value| {
            if key == LIBRARY { Some(vec![format!("\"{value}\"")]) } else { numbers(value, key) }
        });
        let values = values.collect::<Option<Vec<_>>>().ok_or_else(wrong)?.concat();
        let material = name.trim_matches('"').to_owned();
        if material.is_empty() || values.iter().any(|value| value.contains(['\\', '\n']) || value == "\"\"") {
            return Err(wrong());
        }
        Ok(Self { text: text.to_owned(), material, key, values })
    }
}

/// The parts between commas, but for those in brackets.
fn parts(text: &str) -> Vec<&str> {
    let mut depth = 0_u32;
    let is_border = |letter: char| {
        match letter {
            '[' => depth += 1,
            ']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        letter == ',' && depth == 0
    };
    text.split(is_border).map(str::trim).collect()
}

/// A number, a list of them, or the ends of a range of absorption, as TOML.
fn numbers(text: &str, key: &str) -> Option<Vec<String>> {
    let number = |text: &str| text.trim().parse::<f64>().ok().map(|number| format!("{number:?}"));
    if let Some(list) = text.strip_prefix('[') {
        let list: Option<Vec<String>> = list.strip_suffix(']')?.split(',').map(number).collect();
        return Some(vec![format!("[{}]", list?.join(", "))]);
    }
    match text.split_once(':') {
        Some(ends) if key == KEYS[0] => Some(vec![number(ends.0)?, number(ends.1)?]),
        Some(_) => None,
        None => Some(vec![number(text)?]),
    }
}

/// Gives `scene` the variants that `options` name beside those that it states, and the duration that they take unless it states one.
///
/// # Errors
/// When a variant is impossible, or there are too many to be traced together.
pub fn add(options: &[Alternatives], scene: &mut Scene, geometry: &Geometry) -> anyhow::Result<()> {
    let mut by_material = BTreeMap::<&str, Vec<&Alternatives>>::new();
    for option in options {
        by_material.entry(&option.material).or_default().push(option);
    }
    for (name, options) in by_material {
        add_to(name, &options, scene)?;
    }
    let sets = set_count(scene);
    if sets > MOST_SETS {
        bail!(
            "the variants combine to {sets} kinds of scattering and transmission, at most {MOST_SETS} can be traced together: leave some out, or trace several maps; any number of absorptions is possible"
        );
    }
    if scene.has_default_duration && !options.is_empty() {
        scene.duration = scene
            .default_duration(geometry)
            .filter(|&duration| duration <= LONGEST_DEFAULT_DURATION)
            .with_context(|| format!("with the variants the room reverberates for more than {LONGEST_DEFAULT_DURATION} s: give --duration"))?;
    }
    Ok(())
}

/// Gives the material `name` all combinations of what `options` say of its keys.
fn add_to(name: &str, options: &[&Alternatives], scene: &mut Scene) -> anyhow::Result<()> {
    let said = options.iter().map(|option| format!("--for {}", option.text)).collect::<Vec<_>>().join(" ");
    let names =
        || scene.materials.iter().map(|material| format!("\"{}\"", material.name)).collect::<Vec<_>>();
    let index = scene.materials.iter().position(|material| material.name == name).with_context(|| {
        format!("{said}: the scene has no material \"{name}\"; it has {}", names().join(", "))
    })?;
    let is_interface = scene.media.as_ref().is_some_and(|media| media.is_interface(index as u32));
    ensure!(!is_interface, "{said}: \"{name}\" is an interface between regions and has no coefficients");
    ensure!(
        !name.contains(['"', '\\']),
        "{said}: state variants of a material with such a name in the scene file"
    );
    let text = format!("[materials.\"{name}\"]\nvariants = [{}]\n", tables(options).join(", "));
    let read = load_variants(&text, &said, &scene.materials, &scene.bands).map_err(|mut errors| {
        // The lines of the table are not the user's.
        errors.problems.iter_mut().for_each(|problem| problem.place.line = 0);
        errors
    })?;
    if scene.variants.is_empty() {
        scene.variants = vec![Vec::new(); scene.materials.len()];
    }
    let own = &scene.materials[index];
    for variant in read.into_iter().nth(index).unwrap_or_default() {
        let variants = &mut scene.variants[index];
        if variant != *own && !variants.contains(&variant) {
            variants.push(variant);
        }
    }
    if scene.variants.iter().all(Vec::is_empty) {
        scene.variants.clear();
    }
    Ok(())
}

/// A table for every combination of the keys, each with one of its values or that of the material; entries of the library on their own.
fn tables(options: &[&Alternatives]) -> Vec<String> {
    let mut by_key = BTreeMap::<&str, Vec<&str>>::new();
    for option in options {
        by_key.entry(option.key).or_default().extend(option.values.iter().map(String::as_str));
    }
    let entries = by_key.remove(LIBRARY).unwrap_or_default();
    let mut combinations = vec![Vec::new()];
    for (key, values) in by_key {
        let with = |combination: &Vec<String>| {
            let stated = values.iter().map(|value| format!("{key} = {value}"));
            stated.map(|stated| [combination.clone(), vec![stated]].concat()).collect::<Vec<_>>()
        };
        let more: Vec<Vec<String>> = combinations.iter().flat_map(with).collect();
        combinations.extend(more);
    }
    let combinations = combinations.into_iter().skip(1).map(|stated| stated.join(", "));
    let entries = entries.into_iter().map(|entry| format!("{LIBRARY} = {entry}"));
    combinations.chain(entries).map(|stated| format!("{{ {stated} }}")).collect()
}

/// The variants of `scene` in a line of the log.
pub fn in_words(scene: &Scene) -> String {
    let named = scene.materials.iter().zip(&scene.variants).filter(|(_, variants)| !variants.is_empty());
    let named: Vec<String> =
        named.map(|(material, variants)| format!("{} of \"{}\"", variants.len(), material.name)).collect();
    let sets = match set_count(scene) {
        1 => "intervals are those of a trace of each".to_owned(),
        sets => format!(
            "packets are divided among {sets} kinds of scattering and transmission, intervals at most {:.1} times those of a trace of each",
            (sets as f64).sqrt()
        ),
    };
    format!("variants: {}; {sets}; {} s", named.join(", "), scene.duration)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{Bands, Material};

    fn scene() -> Scene {
        let walls = Material::uniform("wall.north", 0.2, 0.5, 8);
        Scene::shoebox([3.0, 4.0, 5.0], walls, Bands::octaves()).with_source("left", [1.0; 3])
    }

    fn added(options: &[&str], scene: &Scene) -> anyhow::Result<Scene> {
        let options: Result<Vec<_>, String> = options.iter().map(|text| Alternatives::parse(text)).collect();
        let mut scene = scene.clone();
        let geometry = scene.geometry()?;
        add(&options.map_err(anyhow::Error::msg)?, &mut scene, &geometry).map(|()| scene)
    }

    #[test]
    fn values_ranges_lists_and_entries_are_variants() {
        let all = [
            "materials.wall.north.absorption=.02, [0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8],0.3:0.9",
            "materials.wall.north=carpet-6mm-foam",
        ];
        let scene = added(&all[..1], &scene()).unwrap();
        let first: Vec<f64> = scene.variants[0].iter().map(|variant| variant.absorption[0]).collect();
        assert_eq!(first, [0.02, 0.1, 0.3, 0.9]);
        assert!(scene.variants[0].iter().all(|variant| variant.scattering == [0.5; 8]));
        // A name of the library that is there, and one that is not.
        let entry = sonel_scene::library::shipped()[0].name.clone();
        let named = added(&[&format!("materials.wall.north={entry}")], &self::scene()).unwrap();
        assert_eq!(named.variants[0].len(), 1);
        let error = added(&["materials.wall.north=carpet-of-nowhere"], &self::scene()).unwrap_err();
        assert!(format!("{error:#}").contains("no material `carpet-of-nowhere`"), "{error:#}");
    }

    #[test]
    fn keys_of_a_material_combine() {
        let options = ["materials.wall.north.absorption=0.4", "materials.wall.north.scattering=0.1,0.2"];
        let scene = added(&options, &scene()).unwrap();
        let found: Vec<[f64; 2]> =
            scene.variants[0].iter().map(|variant| [variant.absorption[0], variant.scattering[0]]).collect();
        assert_eq!(found, [[0.4, 0.5], [0.2, 0.1], [0.2, 0.2], [0.4, 0.1], [0.4, 0.2]]);
        assert!(in_words(&scene).contains("5 of \"wall.north\"; packets are divided among 3 kinds"));
    }

    #[test]
    fn the_default_duration_is_that_of_the_longest_reverberation() {
        let room = scene();
        let geometry = room.geometry().unwrap();
        let duration = room.default_duration(&geometry).unwrap();
        let room = Scene { duration, has_default_duration: true, ..room };
        let longer = added(&["materials.wall.north.absorption=0.1"], &room).unwrap();
        assert!(longer.duration > 1.7 * room.duration, "{}", longer.duration);
        let shorter = added(&["materials.wall.north.absorption=0.4"], &room).unwrap();
        assert_eq!(shorter.duration.to_bits(), room.duration.to_bits());
        let stated = added(&["materials.wall.north.absorption=0.1"], &room.with_duration(0.7)).unwrap();
        assert_eq!(stated.duration.to_bits(), 0.7_f64.to_bits());
    }

    #[test]
    fn what_cannot_be_traced_is_refused() {
        for (option, expected) in [
            ("materials.wall.north.absorption=1.5", "1.5 is outside 0 … 1"),
            ("materials.roof.absorption=0.5", "it has \"wall.north\""),
            ("materials.wall.north.scattering=0.1,0.2,0.3,0.4", "5 kinds of scattering"),
            ("materials.wall.north.scattering=0.1:0.3", "names no variants"),
            ("materials.wall.north.transmission=0.3", "exceeds absorption"),
            ("walls=0.3", "names no variants"),
        ] {
            let error = format!("{:#}", added(&[option], &scene()).unwrap_err());
            assert!(error.contains(expected), "{option}: {error}");
        }
    }
}
