//! `--extend`: continues a map. `--decision`: uses the decision about effects of a map.
//!
//! Settings come from the map; an option with another value is an error.

use std::fmt::Display;
use std::path::Path;

use anyhow::{Context, bail};
use sonel_console::input;
use sonel_console::version::without_build;
use sonel_geometry::Geometry;
use sonel_map::{EffectState, MapHeader, Mode, Settings, SonelMap, Spectral, hexadecimal};
use sonel_scene::Scene;
use sonel_study::effects::{self, Decision};

use crate::VERSION;
use crate::arguments::Arguments;

/// The provenance of the longer run that `arguments` ask for, and the map in `path` that it extends, all of whose paths are
/// sound. `scene` is the scene that the arguments name.
///
/// # Errors
/// When the map is unusable; all contradictions between it and `arguments` or `scene`.
pub fn open(
    path: &Path,
    arguments: &Arguments,
    scene: &Scene,
    geometry: &Geometry,
) -> anyhow::Result<(MapHeader, SonelMap)> {
    let named = || path.display().to_string();
    let map = opened(path)?;
    map.require_whole().with_context(named)?;
    let header = map.header();
    let mut problems = contradictions(arguments, header, scene);
    problems.extend(other_effects(arguments, header, scene, geometry)?);
    unless_any(&problems, path)?;
    let geometry = header.scene.geometry().with_context(named)?;
    map.check_surfaces(&geometry).with_context(named)?;
    map.check_paths(geometry.surfaces().len() as u32).with_context(named)?;
    let emissions = arguments.sonels.unwrap_or(header.settings.emissions);
    let settings = Settings { emissions, ..header.settings };
    let header = MapHeader { tool_version: VERSION.clone(), settings, ..header.clone() };
    Ok((header, map))
}

/// The effects that the map in `path` decided about, and the scene as the decision left it. `scene` is the scene that is traced, in `mode`.
///
/// # Errors
/// When the map is unusable; all contradictions.
pub fn decided(path: &Path, mode: Mode, scene: &Scene) -> anyhow::Result<(Vec<EffectState>, Scene)> {
    let map = opened(path)?;
    let header = map.header();
    let mut problems = other_origin(header, scene);
    if header.settings.mode != mode {
        problems.push(format!(
            "its decision is for --mode {}, this run has {}: use a map of the same mode",
            Mode::name(header.settings.mode),
            Mode::name(mode)
        ));
    }
    if !scene.has_default_duration && header.scene.duration.to_bits() != scene.duration.to_bits() {
        problems.push(format!(
            "its decision is for {} s, this run has {} s: use a map of the same --duration",
            header.scene.duration, scene.duration
        ));
    }
    if header.scene.variants != scene.variants {
        problems.push("its decision is for other variants: use a map traced with the same --for".to_owned());
    }
    unless_any(&problems, path)?;
    Ok((header.effects.clone(), header.scene.clone()))
}

fn opened(path: &Path) -> anyhow::Result<SonelMap> {
    let file = input::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    SonelMap::open(&file).with_context(|| path.display().to_string())
}

/// An error of all `problems` with the map in `path`, if there are any.
fn unless_any(problems: &[String], path: &Path) -> anyhow::Result<()> {
    let problems: Vec<String> =
        problems.iter().map(|problem| format!("{}: {problem}", path.display())).collect();
    if problems.is_empty() { Ok(()) } else { bail!("{}", problems.join("\nerror: ")) }
}

/// What speaks against extending a map with `header`, a sentence each.
fn contradictions(arguments: &Arguments, header: &MapHeader, scene: &Scene) -> Vec<String> {
    let settings = &header.settings;
    let mut problems = other_origin(header, scene);
    if let Some(sonels) = arguments.sonels
        && sonels <= settings.emissions
    {
        problems.push(format!(
            "--sonels {sonels} is not above the {} of the map: give the number of the whole new map",
            settings.emissions
        ));
    }
    if !arguments.variants.is_empty() && scene.variants != header.scene.variants {
        problems.push("--for names other variants than the map was traced with: leave --for out".to_owned());
    }
    problems.extend(
        [
            contradiction("seed", arguments.seed, settings.seed),
            contradiction("batches", arguments.batches, settings.batches),
            contradiction("survival", arguments.survival, settings.survival),
            contradiction("duration", arguments.duration, header.scene.duration),
            contradiction("spectral", arguments.spectral.map(Spectral::name), settings.spectral.name()),
            contradiction("mode", arguments.mode.map(Mode::name), settings.mode.name()),
        ]
        .into_iter()
        .flatten(),
    );
    problems
}

/// Whether another program or another scene made a map with `header`, a sentence each.
fn other_origin(header: &MapHeader, scene: &Scene) -> Vec<String> {
    let mut problems = Vec::new();
    if without_build(&header.tool_version) != without_build(&VERSION) {
        problems.push(format!(
            "sonel {} traced it, this is {}: only the same version can extend it; trace from the beginning",
            header.tool_version, *VERSION
        ));
    }
    for (what, digest, traced) in [
        ("scene file", scene.digest, header.scene.digest),
        ("mesh file", scene.mesh_digest, header.scene.mesh_digest),
    ] {
        if digest != traced {
            problems.push(format!(
                "the {what} has digest {} and was traced with {}: trace the changed scene from the beginning",
                hexadecimal(&digest),
                hexadecimal(&traced)
            ));
        }
    }
    problems
}

/// Effects that `--effects` would decide otherwise than the map that is extended.
fn other_effects(
    arguments: &Arguments,
    header: &MapHeader,
    scene: &Scene,
    geometry: &Geometry,
) -> anyhow::Result<Vec<String>> {
    let Some(spec) = arguments.effects.as_ref().filter(|_| is_same_scene(scene, header)) else {
        return Ok(Vec::new());
    };
    let wanted = effects::decide(spec, header.settings.mode, &mut scene.clone(), geometry);
    let problem = |wanted: &Decision| {
        let name = wanted.effect.name();
        let traced = header.effects.iter().find(|effect| effect.name == name && effect.on != wanted.on)?;
        let [wanted, traced] = [&wanted.on, &traced.on].map(|on| in_words(on));
        Some(format!(
            "--effects would have {name} {wanted}, the map was traced with {traced}: leave --effects out"
        ))
    };
    Ok(wanted.iter().filter_map(problem).collect())
}

fn is_same_scene(scene: &Scene, header: &MapHeader) -> bool {
    (scene.digest, scene.mesh_digest) == (header.scene.digest, header.scene.mesh_digest)
}

fn contradiction<T: PartialEq + Display>(option: &str, given: Option<T>, traced: T) -> Option<String> {
    let given = given.filter(|given| *given != traced)?;
    Some(format!("--{option} {given}, the map was traced with {traced}: leave --{option} out"))
}

/// On or off, band by band.
fn in_words(on: &[bool]) -> String {
    on.iter().map(|&on| if on { "on" } else { "off" }).collect::<Vec<_>>().join(", ")
}
