//! Other materials that a map carries besides those of the scene.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use sonel_geometry::Geometry;
use sonel_map::leads::{MOST_SETS, set_count};
use sonel_scene::{LONGEST_DEFAULT_DURATION, Scene, Value, read_variants};

use crate::coefficients::{self, Coefficients, MaterialKey};
use crate::error::At;
use crate::names::place;
use crate::{Error, ParseError, Result};

/// Most variants of a material: every packet asks for the one that reflects most.
const MOST_VALUES: usize = 256;

/// The key that takes entries of the library.
const LIBRARY: &str = "library";

/// Other values of a material, each of which the map carries besides that of the scene. Values of several keys combine.
#[derive(Debug, Clone, PartialEq)]
pub struct Variants {
    /// Name of the material.
    pub material: String,
    /// The other values.
    pub values: Alternatives,
}

/// Alternatives of a material, or its range.
#[derive(Debug, Clone, PartialEq)]
pub enum Alternatives {
    /// Values of a coefficient. Absorptions between two of them are possible, too.
    Coefficients(MaterialKey, Vec<Coefficients>),
    /// Entries of the shipped library.
    Library(Vec<String>),
}

impl Variants {
    /// Reads the name `materials.NAME.KEY` with values `VALUE,…`, an absorption also as LOW:HIGH, values per band in brackets; or `materials.NAME`
    /// with `ENTRY,…` of the library.
    ///
    /// # Errors
    /// Another name or value.
    pub fn parse(name: &str, values: &str) -> Result<Self, ParseError> {
        let wrong = || wrong(&format!("{name}={values}"));
        let (material, key) = path(name).ok_or_else(wrong)?;
        let values = parts(values);
        let values = match key {
            None if values.iter().any(|entry| entry.is_empty() || entry.contains(['"', '\\', '\n'])) => {
                return Err(wrong());
            }
            None => Alternatives::Library(values.into_iter().map(str::to_owned).collect()),
            Some(key) => {
                let read = values.into_iter().map(|value| numbers(value, key)).collect::<Option<Vec<_>>>();
                Alternatives::Coefficients(key, read.ok_or_else(wrong)?.concat())
            }
        };
        Ok(Self { material, values })
    }

    /// Other `values` of the coefficient that is called `materials.NAME.KEY`.
    ///
    /// # Errors
    /// Another name or value.
    pub fn of(name: &str, values: Vec<Coefficients>) -> Result<Self, ParseError> {
        match path(name) {
            Some((material, Some(key))) => {
                Ok(Self { material, values: Alternatives::Coefficients(key, values) })
            }
            _ => Err(wrong(name)),
        }
    }
}

/// `materials.walls.absorption=0.02,0.9`, `materials.walls=ENTRY,…` of the library.
impl FromStr for Variants {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        let (name, values) = text.split_once('=').unwrap_or((text, ""));
        Self::parse(name, values)
    }
}

/// `materials.walls.absorption=0.02,0.9`.
impl fmt::Display for Variants {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.values {
            Alternatives::Coefficients(key, values) => {
                let values: Vec<String> = values.iter().map(Coefficients::to_string).collect();
                write!(f, "materials.{}.{}={}", self.material, key.name(), values.join(","))
            }
            Alternatives::Library(entries) => write!(f, "materials.{}={}", self.material, entries.join(",")),
        }
    }
}

fn wrong(text: &str) -> ParseError {
    ParseError(format!(
        "\"{text}\" names no variants: write materials.NAME.absorption=0.02,0.9 (or a range 0.02:0.9, or [0.1,0.2,…] per band; also {}), or materials.NAME=ENTRY,ENTRY of the library",
        MaterialKey::ALL[1..].iter().map(|key| key.name()).collect::<Vec<_>>().join(", ")
    ))
}

/// Material and key of `materials.NAME.KEY` or `materials.NAME`.
fn path(name: &str) -> Option<(String, Option<MaterialKey>)> {
    let path = name.trim().strip_prefix("materials.")?;
    let with_key = path.rsplit_once('.').and_then(|(name, key)| Some((name, Some(MaterialKey::named(key)?))));
    let (name, key) = with_key.unwrap_or((path, None));
    let name = name.trim_matches('"');
    (!name.is_empty()).then(|| (name.to_owned(), key))
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

/// A number, a list of them, or the ends of a range of absorption.
fn numbers(text: &str, key: MaterialKey) -> Option<Vec<Coefficients>> {
    match text.split_once(':') {
        Some((low, high)) if key == MaterialKey::Absorption => {
            Some(vec![coefficients::parse(low)?, coefficients::parse(high)?])
        }
        Some(_) => None,
        None => Some(vec![coefficients::parse(text)?]),
    }
}

/// Gives `scene` the variants that `options` name beside those that it states, and the duration that they take unless it states one.
///
/// # Errors
/// When a variant is impossible, or there are too many to be traced together.
pub(crate) fn add(options: &[Variants], scene: &mut Scene, geometry: &Geometry) -> Result<()> {
    let mut by_material = BTreeMap::<&str, Vec<&Variants>>::new();
    for option in options {
        by_material.entry(&option.material).or_default().push(option);
    }
    for (name, options) in by_material {
        add_to(name, &options, scene)?;
    }
    if let Some(variants) = scene.variants.iter().find(|variants| variants.len() > MOST_VALUES) {
        return Err(Error::refused(format!(
            "material \"{}\" has {} variants, at most {MOST_VALUES} are carried: give a range of absorptions, LOW:HIGH, all of which are possible",
            variants[0].name,
            variants.len()
        )));
    }
    if set_count(scene) > MOST_SETS {
        return Err(Error::refused(format!(
            "the variants combine to more than {MOST_SETS} kinds of scattering and transmission, which is the most that can be traced together: leave some out, name combinations in [variants.NAME], or trace several maps; any number of absorptions is possible"
        )));
    }
    if scene.has_default_duration && !options.is_empty() {
        let duration = scene.default_duration(geometry);
        scene.duration = duration.filter(|&duration| duration <= LONGEST_DEFAULT_DURATION).ok_or_else(|| {
            Error::refused(format!("with the variants the room reverberates for more than {LONGEST_DEFAULT_DURATION} s: give `duration`"))
        })?;
    }
    Ok(())
}

/// Gives the material `name` all combinations of what `options` say of its keys.
fn add_to(name: &str, options: &[&Variants], scene: &mut Scene) -> Result<()> {
    let said = options.iter().map(|option| format!("`variants` {option}")).collect::<Vec<_>>().join(" ");
    let known = scene.materials.iter().map(|material| material.name.as_str());
    let index = place(known, name, "the scene has no material").at(|| said.clone())?;
    if scene.media.as_ref().is_some_and(|media| media.is_interface(index as u32)) {
        let problem = format!("{said}: \"{name}\" is an interface between regions and has no coefficients");
        return Err(Error::refused(problem));
    }
    let read = read_variants(&said, name, tables(options), &scene.materials, &scene.bands)?;
    if scene.variants.is_empty() {
        scene.variants = vec![Vec::new(); scene.materials.len()];
    }
    let own = &scene.materials[index];
    for variant in read {
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
fn tables(options: &[&Variants]) -> Vec<Value> {
    let mut by_key = BTreeMap::<&'static str, Vec<&Coefficients>>::new();
    let mut entries = Vec::new();
    for option in options {
        match &option.values {
            Alternatives::Coefficients(key, values) => by_key.entry(key.name()).or_default().extend(values),
            Alternatives::Library(names) => entries.extend(names),
        }
    }
    let mut combinations = vec![Vec::new()];
    for (key, values) in by_key {
        let with = |combination: &Vec<(&'static str, Value)>| {
            let stated = values.iter().map(|&value| (key, Value::from(value.clone())));
            stated.map(|stated| [combination.clone(), vec![stated]].concat()).collect::<Vec<_>>()
        };
        let more: Vec<Vec<_>> = combinations.iter().flat_map(with).collect();
        combinations.extend(more);
    }
    let combinations = combinations.into_iter().skip(1).map(Value::table);
    let entries = entries.into_iter().map(|entry| Value::table([(LIBRARY, entry.as_str())]));
    combinations.chain(entries).collect()
}

/// The variants of `scene` in a line of the log.
pub(crate) fn in_words(scene: &Scene) -> String {
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

    fn added(options: &[&str], scene: &Scene) -> Result<Scene> {
        let options = options.iter().map(|text| text.parse()).collect::<Result<Vec<Variants>, _>>()?;
        let mut scene = scene.clone();
        let geometry = scene.geometry()?;
        add(&options, &mut scene, &geometry).map(|()| scene)
    }

    #[test]
    fn more_variants_than_are_carried_are_refused() {
        let of = |count: usize| {
            let values: Vec<String> = (1..=count).map(|at| (at as f64 / 1000.0).to_string()).collect();
            added(&[&format!("materials.wall.north.absorption={}", values.join(","))], &scene())
        };
        // One of them is that of the material.
        assert_eq!(of(MOST_VALUES + 1).unwrap().variants[0].len(), MOST_VALUES);
        let said = of(MOST_VALUES + 2).unwrap_err().to_string();
        assert!(said.contains("has 257 variants, at most 256 are carried: give a range"), "{said}");
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
        assert!(error.to_string().contains("no material `carpet-of-nowhere`"), "{error}");
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
            ("materials.wall.north.scattering=0.1,0.2,0.3,0.4", "more than 4 kinds of scattering"),
            ("materials.wall.north.scattering=0.1:0.3", "names no variants"),
            ("materials.wall.north.transmission=0.3", "exceeds absorption"),
            ("walls=0.3", "names no variants"),
        ] {
            let error = added(&[option], &scene()).unwrap_err().to_string();
            assert!(error.contains(expected), "{option}: {error}");
        }
    }
}
