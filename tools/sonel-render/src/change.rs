//! `--set` and `--materials`: other coefficients and directivities on the same map.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use sonel_acoustics::{Directivity, Material, Pattern};
use sonel_console::input;
use sonel_scene::{Scene, Source, is_balloon_file, load_balloon, load_materials};

/// One `--set`: what it changes and the value as written.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// As it was written.
    text: String,
    section: Section,
    name: String,
    key: String,
    value: String,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Section {
    Materials,
    Sources,
}

/// Keys of a material, each with the one that it replaces.
const MATERIAL_KEYS: [(&str, &str); 5] = [
    ("absorption", "absorption"),
    ("scattering", "scattering"),
    ("diffuse", "scattering"),
    ("transmission", "transmission"),
    ("sound_reduction_db", "transmission"),
];

impl Assignment {
    /// Reads `materials.NAME.KEY=VALUE` or `sources.NAME.directivity=WORD` or a file.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "\"{text}\" is not a change: write materials.NAME.absorption=0.4 or sources.NAME.directivity=cardioid"
            )
        };
        let (path, value) = text.split_once('=').ok_or_else(wrong)?;
        let (section, rest) = path.trim().split_once('.').ok_or_else(wrong)?;
        let (name, key) = rest.rsplit_once('.').ok_or_else(wrong)?;
        let section = match section {
            "materials" => Section::Materials,
            "sources" => Section::Sources,
            _ => return Err(wrong()),
        };
        let known: Vec<&str> = match section {
            Section::Materials => MATERIAL_KEYS.iter().map(|(key, _)| *key).collect(),
            Section::Sources => vec!["directivity"],
        };
        if !known.contains(&key) {
            return Err(format!("`{key}` cannot be changed on a map; can be: {}", known.join(", ")));
        }
        let text = text.to_owned();
        Ok(Self { text, section, name: name.to_owned(), key: key.to_owned(), value: value.trim().to_owned() })
    }

    /// The file that it names.
    pub fn file(&self) -> Option<PathBuf> {
        (self.section == Section::Sources && is_balloon_file(&self.value)).then(|| PathBuf::from(&self.value))
    }

    /// The value as TOML: a list may be written without brackets.
    fn value(&self) -> String {
        if self.value.contains(',') && !self.value.starts_with('[') {
            format!("[{}]", self.value)
        } else {
            self.value.clone()
        }
    }
}

/// Materials and sources of `scene` after `file` and then `assignments`.
pub fn changed(
    scene: &Scene,
    file: Option<&Path>,
    assignments: &[Assignment],
) -> anyhow::Result<(Vec<Material>, Vec<Source>)> {
    let mut materials = scene.materials.clone();
    if let Some(file) = file {
        let label = file.display().to_string();
        let text =
            std::fs::read_to_string(file).with_context(|| format!("cannot read the materials {label}"))?;
        replace(&mut materials, load_materials(&text, &label, &scene.bands)?, &label)?;
    }
    let of = |section: Section| assignments.iter().filter(move |assignment| assignment.section == section);
    let mut tables = BTreeMap::<&str, Vec<&Assignment>>::new();
    for assignment in of(Section::Materials) {
        tables.entry(&assignment.name).or_default().push(assignment);
    }
    for (name, assignments) in tables {
        let material = find(&mut materials, name, |material| &material.name, "material")?;
        let text = as_toml(material, &assignments)?;
        let options: Vec<String> =
            assignments.iter().map(|assignment| format!("--set {}", assignment.text)).collect();
        let read = load_materials(&text, &options.join(" "), &scene.bands).map_err(|mut errors| {
            // The lines of the table are not the user's.
            errors.problems.iter_mut().for_each(|problem| problem.place.line = 0);
            errors
        })?;
        *material = read.into_iter().next().context("a table of one material")?;
    }
    if let Some(at) = (0..materials.len()).find(|&at| materials[at].law != scene.materials[at].law) {
        let Material { name, law, .. } = &scene.materials[at];
        bail!(
            "the absorption law of \"{name}\" cannot be changed on a map; it is {law}: keep it, or trace the scene with the other law"
        );
    }
    let interfaces = scene.media.iter().flat_map(|media| &media.interfaces);
    if let Some(changed) =
        interfaces.map(|&index| index as usize).find(|&at| materials[at] != scene.materials[at])
    {
        bail!("\"{}\" is an interface between regions and has no coefficients", materials[changed].name);
    }
    let mut sources = scene.sources.clone();
    for assignment in of(Section::Sources) {
        let source = find(&mut sources, &assignment.name, |source| &source.name, "source")?;
        source.directivity = directivity(&assignment.value, source, scene)
            .with_context(|| format!("sources.{}.directivity", assignment.name))?;
    }
    Ok((materials, sources))
}

/// The pattern of this name, or what the file of this name holds: azimuths are counted towards what was up before, or the scene's up.
fn directivity(value: &str, source: &Source, scene: &Scene) -> anyhow::Result<Directivity> {
    if !is_balloon_file(value) {
        return Ok(value.parse::<Pattern>()?.into());
    }
    let bytes = input::read(Path::new(value)).with_context(|| format!("cannot read {value}"))?;
    let (balloon, _) = load_balloon(value, &bytes, &scene.bands)?;
    let up = match &source.directivity {
        Directivity::Measured { up, .. } => *up,
        Directivity::Pattern(_) => scene.up,
    };
    Directivity::measured(balloon, source.aim, up)
        .context("the source aims straight up or down: trace the scene with this file and up = [x, y, z]")
}

/// Puts `others` in the place of the materials of the same names.
fn replace(materials: &mut [Material], others: Vec<Material>, label: &str) -> anyhow::Result<()> {
    for other in others {
        let name = other.name.clone();
        *find(materials, &name, |material| &material.name, "material").with_context(|| label.to_owned())? =
            other;
    }
    Ok(())
}

fn find<'a, T>(
    all: &'a mut [T],
    name: &str,
    name_of: impl Fn(&T) -> &str,
    kind: &str,
) -> anyhow::Result<&'a mut T> {
    let known: Vec<String> = all.iter().map(|one| format!("\"{}\"", name_of(one))).collect();
    let found = all.iter_mut().find(|one| name_of(one) == name);
    found.with_context(|| format!("the map has no {kind} \"{name}\"; it has {}", known.join(", ")))
}

/// The table of a material as a scene file has it, with `assignments` in place of what they replace.
fn as_toml(material: &Material, assignments: &[&Assignment]) -> anyhow::Result<String> {
    let lists = [
        ("absorption", &material.absorption),
        ("scattering", &material.scattering),
        ("transmission", &material.transmission),
    ];
    let mut lines: BTreeMap<&str, String> =
        lists.into_iter().map(|(key, values)| (key, format!("{key} = {values:?}"))).collect();
    lines.insert("absorption_law", format!("absorption_law = \"{}\"", material.law));
    let mut changed = Vec::new();
    for assignment in assignments {
        let (_, replaced) =
            MATERIAL_KEYS.iter().find(|(key, _)| *key == assignment.key).context("a key that was parsed")?;
        if changed.contains(replaced) {
            bail!("materials.{}.{replaced} is changed twice; keep one", material.name);
        }
        changed.push(replaced);
        lines.insert(replaced, format!("{} = {}", assignment.key, assignment.value()));
    }
    ensure!(
        !material.name.contains('"'),
        "a material whose name has quotes cannot be changed by --set; use --materials"
    );
    let lines: Vec<String> = lines.into_values().collect();
    Ok(format!("[materials.\"{}\"]\n{}\n", material.name, lines.join("\n")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::Bands;

    fn scene() -> Scene {
        let material = Material::uniform("wall.north", 0.2, 0.5, 8);
        Scene::shoebox([3.0, 4.0, 5.0], material, Bands::octaves()).with_source("left", [1.0; 3])
    }

    fn change(assignments: &[&str]) -> anyhow::Result<(Vec<Material>, Vec<Source>)> {
        let parsed: Vec<Assignment> =
            assignments.iter().map(|text| Assignment::parse(text).unwrap()).collect();
        changed(&scene(), None, &parsed)
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
    fn what_cannot_be_set_is_refused_by_name() {
        for (text, expected) in [
            ("materials.roof.absorption=0.1", "it has \"wall.north\""),
            (
                "materials.wall.north.absorption=1.5",
                "--set materials.wall.north.absorption=1.5: materials.\"wall.north\".absorption: 1.5 is outside 0 … 1; give 1",
            ),
            ("materials.wall.north.transmission=0.5", "exceeds absorption"),
            ("sources.left.directivity=narrow", "unknown directivity"),
        ] {
            let error = format!("{:#}", change(&[text]).unwrap_err());
            assert!(error.contains(expected), "{text}: {error}");
        }
        assert!(
            change(&["materials.wall.north.diffuse=0.1", "materials.wall.north.scattering=0.1"]).is_err()
        );
        assert!(Assignment::parse("materials.wall.colour=1").unwrap_err().contains("can be: absorption"));
        assert!(Assignment::parse("walls=1").is_err());
    }

    #[test]
    fn a_material_keeps_its_law() {
        let mut walls = Material::uniform("walls", 0.2, 0.1, 8);
        walls.law = sonel_acoustics::AbsorptionLaw::LocallyReacting;
        let scene = Scene::shoebox([4.0, 4.0, 4.0], walls, Bands::octaves());
        let set = |text: &str| changed(&scene, None, &[Assignment::parse(text).unwrap()]);
        let (materials, _) = set("materials.walls.absorption=0.4").unwrap();
        assert_eq!(materials[0].law, scene.materials[0].law);
        assert!(set("materials.walls.absorption=0.97").is_err());
    }
}
