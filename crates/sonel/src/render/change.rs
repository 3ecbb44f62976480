//! Other coefficients and directivities on the same map.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use sonel_acoustics::{Directivity, Material, Pattern, TALKER, talker};
use sonel_scene::{
    Scene, Source, Value, is_balloon_file, load_balloon, load_materials, read_material, read_variants,
};

use crate::coefficients::{self, Coefficients, MaterialKey};
use crate::error::At;
use crate::file;
use crate::names::place;
use crate::{Error, ParseError, Result};

/// Change of a rendering against the scene of its map.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// A coefficient of a material.
    Coefficient(String, MaterialKey, Coefficients),
    /// Entries of the shipped library for a material; the first that has a coefficient counts.
    Library(String, Vec<String>),
    /// Directivity of a source: a word such as `cardioid` or `talker`, or a file.
    Directivity(String, String),
}

/// `materials.walls.absorption=0.4`.
impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Coefficient(material, key, values) => {
                let values = values.to_string();
                let values = values.trim_start_matches('[').trim_end_matches(']');
                write!(f, "materials.{material}.{}={values}", key.name())
            }
            Self::Library(material, entries) => {
                write!(f, "materials.{material}.{LIBRARY}={}", entries.join(","))
            }
            Self::Directivity(source, value) => write!(f, "sources.{source}.directivity={value}"),
        }
    }
}

/// The key that takes entries of the library.
const LIBRARY: &str = "library";

/// Coefficients that a key of a material replaces.
fn replaced(key: MaterialKey) -> &'static str {
    match key {
        MaterialKey::Diffuse => MaterialKey::Scattering.name(),
        MaterialKey::SoundReductionDb => MaterialKey::Transmission.name(),
        other => other.name(),
    }
}

impl Change {
    /// Reads the name `materials.NAME.KEY` or `sources.NAME.directivity` with its value: numbers between commas, or a word.
    ///
    /// # Errors
    /// Another name or value.
    pub fn parse(name: &str, value: &str) -> Result<Self, ParseError> {
        let value = value.trim();
        if let Some(material) = borrower(name) {
            let entries = value.split(',').map(|entry| entry.trim().trim_matches('"').to_owned());
            return Ok(Self::Library(material.to_owned(), entries.collect()));
        }
        match subject(name)? {
            (material, Some(key)) => {
                let values = coefficients::parse(value);
                let values = values.ok_or_else(|| wrong(&format!("{name}={value}")))?;
                Ok(Self::Coefficient(material, key, values))
            }
            (source, None) => Ok(Self::Directivity(source, value.to_owned())),
        }
    }

    /// Gives `values` to the coefficient of the name `materials.NAME.KEY`.
    ///
    /// # Errors
    /// Another name or value.
    pub fn of(name: &str, values: Coefficients) -> Result<Self, ParseError> {
        match subject(name)? {
            (material, Some(key)) => Ok(Self::Coefficient(material, key, values)),
            _ => Err(wrong(name)),
        }
    }

    /// The file that it names.
    #[must_use]
    pub fn file(&self) -> Option<PathBuf> {
        match self {
            Self::Directivity(_, value) if is_balloon_file(value) => Some(PathBuf::from(value)),
            _ => None,
        }
    }
}

/// `materials.walls.absorption=0.4`, `sources.stage.directivity=cardioid`.
impl FromStr for Change {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        Self::parse(name, value)
    }
}

fn wrong(text: &str) -> ParseError {
    ParseError(format!(
        "\"{text}\" is not a change: write materials.NAME.absorption=0.4 or sources.NAME.directivity=cardioid"
    ))
}

/// The material of `materials.NAME.library`.
fn borrower(name: &str) -> Option<&str> {
    name.trim().strip_prefix("materials.")?.strip_suffix(LIBRARY)?.strip_suffix('.')
}

/// The name of a material with a key, or that of a source.
fn subject(text: &str) -> Result<(String, Option<MaterialKey>), ParseError> {
    let parts =
        text.trim().split_once('.').and_then(|(section, rest)| Some((section, rest.rsplit_once('.')?)));
    let known: Vec<&str> = MaterialKey::ALL.iter().map(|key| key.name()).collect();
    let (key, known) = match parts {
        Some(("materials", (name, key))) => match MaterialKey::named(key) {
            Some(key) => return Ok((name.to_owned(), Some(key))),
            None => (key, format!("{}, {LIBRARY}", known.join(", "))),
        },
        Some(("sources", (name, "directivity"))) => return Ok((name.to_owned(), None)),
        Some(("sources", (_, key))) => (key, "directivity".to_owned()),
        _ => return Err(wrong(text)),
    };
    Err(ParseError(format!("`{key}` cannot be changed on a map; can be: {known}")))
}

/// Materials and sources of `scene` after the variant, the file of materials and then `changes`.
pub(super) fn changed(
    scene: &Scene,
    variant: Option<&str>,
    path: Option<&Path>,
    changes: &[Change],
) -> Result<(Vec<Material>, Vec<Source>)> {
    let mut materials = match variant {
        Some(name) => scene.design(name).ok_or_else(|| no_variant(name, scene))?,
        None => scene.materials.clone(),
    };
    if let Some(path) = path {
        let label = path.display().to_string();
        let text = file::read_to_string(path).at(|| format!("cannot read the materials {label}"))?;
        for other in load_materials(&text, &label, &scene.bands)? {
            let own = find(&mut materials, &other.name, |material| &material.name, "material");
            *own.at(|| label.clone())? = other;
        }
    }
    for change in changes {
        if let Change::Library(name, entries) = change {
            let material = find(&mut materials, name, |material| &material.name, "material")?;
            let entries: Vec<Value> = entries.iter().map(|entry| entry.as_str().into()).collect();
            let table = vec![Value::table([(LIBRARY, entries)])];
            let own = std::slice::from_ref(&*material);
            let mut read = read_variants(&format!("`set` {change}"), name, table, own, &scene.bands)?;
            *material = read.remove(0);
        }
    }
    let mut tables = BTreeMap::<&str, Vec<&Change>>::new();
    for change in changes {
        if let Change::Coefficient(name, ..) = change {
            tables.entry(name).or_default().push(change);
        }
    }
    for (name, changes) in tables {
        let material = find(&mut materials, name, |material| &material.name, "material")?;
        let said: Vec<String> = changes.iter().map(|change| format!("`set` {change}")).collect();
        *material = read_material(&said.join(" "), name, keys(material, &changes)?, &scene.bands)?;
    }
    check_kept(scene, &materials)?;
    let mut sources = scene.sources.clone();
    for change in changes {
        if let Change::Directivity(name, value) = change {
            let source = find(&mut sources, name, |source| &source.name, "source")?;
            source.directivity =
                directivity(value, source, scene).at(|| format!("sources.{name}.directivity"))?;
        }
    }
    Ok((materials, sources))
}

fn no_variant(name: &str, scene: &Scene) -> Error {
    let known: Vec<String> = scene.designs.iter().map(|design| format!("\"{}\"", design.name)).collect();
    let known = match known.as_slice() {
        [] => "none: name some in the scene file, [variants.NAME], and trace it".to_owned(),
        known => known.join(", "),
    };
    Error::refused(format!("the map has no variant \"{name}\"; it has {known}"))
}

/// Checks that `materials` have the laws and interfaces of `scene`.
fn check_kept(scene: &Scene, materials: &[Material]) -> Result<()> {
    if let Some(at) = (0..materials.len()).find(|&at| materials[at].law != scene.materials[at].law) {
        let Material { name, law, .. } = &scene.materials[at];
        return Err(Error::refused(format!(
            "the absorption law of \"{name}\" cannot be changed on a map; it is {law}: keep it, or trace the scene with the other law"
        )));
    }
    let interfaces = scene.media.iter().flat_map(|media| &media.interfaces);
    if let Some(changed) =
        interfaces.map(|&index| index as usize).find(|&at| materials[at] != scene.materials[at])
    {
        return Err(Error::refused(format!(
            "\"{}\" is an interface between regions and has no coefficients",
            materials[changed].name
        )));
    }
    Ok(())
}

/// The pattern of this name, a talker, or what the file of this name holds: azimuths are counted towards what was up before, or the scene's up.
fn directivity(value: &str, source: &Source, scene: &Scene) -> Result<Directivity> {
    if value == TALKER {
        let found = Directivity::measured(talker(&scene.bands), source.aim, scene.up);
        return found.ok_or_else(|| Error::refused("a talker needs an aim"));
    }
    if !is_balloon_file(value) {
        let pattern = value.parse::<Pattern>().map_err(|unknown| Error::refused(unknown.to_string()))?;
        return Ok(pattern.into());
    }
    let bytes = file::read(Path::new(value)).at(|| format!("cannot read {value}"))?;
    let (balloon, _) = load_balloon(value, &bytes, &scene.bands)?;
    let up = match &source.directivity {
        Directivity::Measured { up, .. } => *up,
        Directivity::Pattern(_) => scene.up,
    };
    Directivity::measured(balloon, source.aim, up).ok_or_else(|| {
        Error::refused(
            "the source aims straight up or down: trace the scene with this file and up = [x, y, z]",
        )
    })
}

fn find<'a, T>(all: &'a mut [T], name: &str, name_of: impl Fn(&T) -> &str, kind: &str) -> Result<&'a mut T> {
    let at = place(all.iter().map(name_of), name, &format!("the map has no {kind}"));
    Ok(&mut all[at?])
}

/// The keys of a material in a scene file, with `changes` in place of what they replace.
fn keys(material: &Material, changes: &[&Change]) -> Result<Vec<(&'static str, Value)>> {
    let lists = [
        ("absorption", &material.absorption),
        ("scattering", &material.scattering),
        ("transmission", &material.transmission),
    ];
    let mut entries: BTreeMap<&'static str, (&'static str, Value)> =
        lists.into_iter().map(|(key, values)| (key, (key, values.clone().into()))).collect();
    let mut changed = Vec::new();
    for change in changes {
        let Change::Coefficient(_, key, values) = change else { continue };
        let replaced = replaced(*key);
        if changed.contains(&replaced) {
            return Err(Error::refused(format!(
                "materials.{}.{replaced} is changed twice; keep one",
                material.name
            )));
        }
        changed.push(replaced);
        entries.insert(replaced, (key.name(), values.clone().into()));
    }
    let law = ("absorption_law", material.law.to_string().into());
    Ok(entries.into_values().chain([law]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::Bands;

    fn scene() -> Scene {
        let material = Material::uniform("wall.north", 0.2, 0.5, 8);
        Scene::shoebox([3.0, 4.0, 5.0], material, Bands::octaves()).with_source("left", [1.0; 3])
    }

    fn change(changes: &[&str]) -> Result<(Vec<Material>, Vec<Source>)> {
        let parsed: Vec<Change> = changes.iter().map(|text| text.parse::<Change>().unwrap()).collect();
        changed(&scene(), None, None, &parsed)
    }

    #[test]
    fn what_is_set_changes_and_the_rest_stays() {
        let (materials, sources) = change(&[
            "materials.wall.north.absorption=0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8",
            "materials.wall.north.sound_reduction_db = 20",
            "sources.left.directivity=cardioid",
        ])
        .unwrap();
        assert!((materials[0].absorption[7] - 0.8).abs() < 1e-15);
        assert!(materials[0].scattering.iter().all(|s| (s - 0.5).abs() < 1e-15));
        assert!((materials[0].transmission[3] - 0.01).abs() < 1e-15);
        assert_eq!(sources[0].directivity, Pattern::Cardioid.into());
    }

    #[test]
    fn a_talker_is_set_by_its_word() {
        let (_, sources) = change(&["sources.left.directivity=talker"]).unwrap();
        let aim = sources[0].aim;
        let level = |direction| libm::log10(sources[0].directivity.towards(aim, direction).factor(4)) * 10.0;
        assert!((level(aim) - level(-aim) - 6.3).abs() < 1e-9, "front re back at 1 kHz");
    }

    #[test]
    fn a_directivity_is_set_from_sofa() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../sonel-scene/tests/sofa/turned.sofa");
        let set = [Change::parse("sources.left.directivity", file).unwrap()];
        assert_eq!(set[0].file(), Some(PathBuf::from(file)));
        let bands = Bands::new(vec![500.0, 1000.0], sonel_acoustics::BandWidth::Octave).unwrap();
        let scene = Scene::shoebox([3.0, 4.0, 5.0], Material::uniform("walls", 0.2, 0.5, 2), bands)
            .with_source("left", [1.0; 3]);
        let (_, sources) = changed(&scene, None, None, &set).unwrap();
        let towards = sources[0].directivity.towards(sources[0].aim, sources[0].aim);
        assert!((towards.factor(0) - 1.4).abs() < 1e-6, "{}", towards.factor(0));
        // All octaves are more than it has.
        let error = changed(&self::scene(), None, None, &set).unwrap_err().to_string();
        assert!(error.contains("turned.sofa: no frequency within the bands 63, 125"), "{error}");
    }

    #[test]
    fn what_cannot_be_set_is_refused_by_name() {
        for (text, expected) in [
            ("materials.roof.absorption=0.1", "it has \"wall.north\""),
            (
                "materials.wall.north.absorption=1.5",
                "`set` materials.wall.north.absorption=1.5: materials.\"wall.north\".absorption: 1.5 is outside 0 … 1; give 1",
            ),
            ("materials.wall.north.transmission=0.5", "exceeds absorption"),
            ("sources.left.directivity=narrow", "unknown directivity"),
        ] {
            let error = change(&[text]).unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
        assert!(
            change(&["materials.wall.north.diffuse=0.1", "materials.wall.north.scattering=0.1"]).is_err()
        );
        assert!("materials.wall.colour=1".parse::<Change>().unwrap_err().0.contains("can be: absorption"));
        assert!("walls=1".parse::<Change>().is_err());
        assert!("materials.a.absorption=loud".parse::<Change>().unwrap_err().0.contains("is not a change"));
        let odd = Change::of("materials.a=b.absorption", 0.3.into()).unwrap();
        assert_eq!(odd, Change::Coefficient("a=b".to_owned(), MaterialKey::Absorption, 0.3.into()));
    }

    #[test]
    fn entries_of_the_library_are_set_by_name() {
        let (materials, _) = change(&[
            "materials.wall.north.library=\"chairs-wooden\", scattering-classroom",
            "materials.wall.north.absorption=0.9",
        ])
        .unwrap();
        assert!((materials[0].scattering[3] - 0.4).abs() < 1e-15, "{:?}", materials[0]);
        assert!(materials[0].absorption.iter().all(|a| (a - 0.9).abs() < 1e-15));
        let error = change(&["materials.wall.north.library=carpet-of-nowhere"]).unwrap_err().to_string();
        assert!(error.contains("no material `carpet-of-nowhere`"), "{error}");
    }

    #[test]
    fn a_material_keeps_its_law() {
        let mut walls = Material::uniform("walls", 0.2, 0.1, 8);
        walls.law = sonel_acoustics::AbsorptionLaw::LocallyReacting;
        let scene = Scene::shoebox([4.0, 4.0, 4.0], walls, Bands::octaves());
        let set = |text: &str| changed(&scene, None, None, &[text.parse::<Change>().unwrap()]);
        let (materials, _) = set("materials.walls.absorption=0.4").unwrap();
        assert_eq!(materials[0].law, scene.materials[0].law);
        assert!(set("materials.walls.absorption=0.97").is_err());
    }
}
