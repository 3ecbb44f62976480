//! `extend`: continues a map. `decision`: uses the decision about effects of a map.
//!
//! Settings come from the map; an option with another value is an error.

use std::fmt::Display;

use crate::study::effects::{self, Decision};
use sonel_geometry::Geometry;
use sonel_map::{EffectState, MapHeader, Mode, Settings, Spectral, hexadecimal};
use sonel_scene::Scene;

use crate::error::At;
use crate::trace::{TraceOptions, VERSION};
use crate::version::without_build;
use crate::{Error, Map, Result};

/// The provenance of the longer run of `map` that `options` ask for; all its paths have been checked. `scene` is the scene that is traced.
///
/// # Errors
/// When the map is unusable; all contradictions between it and `options` or `scene`.
pub(super) fn longer(
    map: &Map,
    options: &TraceOptions<'_>,
    scene: &Scene,
    geometry: &Geometry,
) -> Result<MapHeader> {
    let named = || map.label().to_owned();
    map.sonels().require_whole().at(named)?;
    let header = map.sonels().header();
    let mut problems = contradictions(options, header, scene);
    problems.extend(other_effects(options, header, scene, geometry));
    unless_any(&problems, map)?;
    map.check()?;
    let emissions = options.packets.unwrap_or(header.settings.emissions);
    let settings = Settings { emissions, ..header.settings };
    Ok(MapHeader { tool_version: VERSION.clone(), settings, ..header.clone() })
}

/// The effects that `map` decided about, and the scene as the decision left it. `scene` is the scene that is traced, in `mode`.
///
/// # Errors
/// All contradictions.
pub(super) fn decided(map: &Map, mode: Mode, scene: &Scene) -> Result<(Vec<EffectState>, Scene)> {
    let header = map.sonels().header();
    let mut problems = other_origin(header, scene);
    if header.settings.mode != mode {
        problems.push(format!(
            "its decision is for `mode` {}, this run has {}: use a map of the same mode",
            Mode::name(header.settings.mode),
            Mode::name(mode)
        ));
    }
    if !scene.has_default_duration && header.scene.duration.to_bits() != scene.duration.to_bits() {
        problems.push(format!(
            "its decision is for {} s, this run has {} s: use a map of the same `duration`",
            header.scene.duration, scene.duration
        ));
    }
    if header.scene.variants != scene.variants {
        problems
            .push("its decision is for other variants: use a map traced with the same `variants`".to_owned());
    }
    unless_any(&problems, map)?;
    Ok((header.effects.clone(), header.scene.clone()))
}

/// An error of all `problems` with `map`, if there are any.
fn unless_any(problems: &[String], map: &Map) -> Result<()> {
    let problems: Vec<String> =
        problems.iter().map(|problem| format!("{}: {problem}", map.label())).collect();
    if problems.is_empty() { Ok(()) } else { Err(Error::Refused(problems)) }
}

/// Objections to extending a map with `header`, a sentence each.
fn contradictions(options: &TraceOptions<'_>, header: &MapHeader, scene: &Scene) -> Vec<String> {
    let settings = &header.settings;
    let mut problems = other_origin(header, scene);
    if let Some(packets) = options.packets
        && packets <= settings.emissions
    {
        problems.push(format!(
            "`packets` {packets} is not above the {} of the map: give the number of the whole new map",
            settings.emissions
        ));
    }
    if !options.variants.is_empty() && scene.variants != header.scene.variants {
        problems.push(
            "`variants` names other variants than the map was traced with: leave `variants` out".to_owned(),
        );
    }
    problems.extend(
        [
            contradiction("seed", options.seed, settings.seed),
            contradiction("batches", options.batches, settings.batches),
            contradiction("survival", options.survival, settings.survival),
            contradiction("duration", options.duration, header.scene.duration),
            contradiction("spectral", options.spectral.map(Spectral::name), settings.spectral.name()),
            contradiction("mode", options.mode.map(Mode::name), settings.mode.name()),
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

/// Effects that `effects` would decide otherwise than the map that is extended.
fn other_effects(
    options: &TraceOptions<'_>,
    header: &MapHeader,
    scene: &Scene,
    geometry: &Geometry,
) -> Vec<String> {
    let Some(asked) = options.effects.as_ref().filter(|_| is_same_scene(scene, header)) else {
        return Vec::new();
    };
    let wanted = effects::decide(asked, header.settings.mode, &mut scene.clone(), geometry);
    let problem = |wanted: &Decision| {
        let name = wanted.effect.name();
        let traced = header.effect(wanted.effect).filter(|traced| traced.on != wanted.on)?;
        let [wanted, traced] = [&wanted.on, &traced.on].map(|on| in_words(on));
        Some(format!(
            "`effects` would have {name} {wanted}, the map was traced with {traced}: leave `effects` out"
        ))
    };
    wanted.iter().filter_map(problem).collect()
}

fn is_same_scene(scene: &Scene, header: &MapHeader) -> bool {
    (scene.digest, scene.mesh_digest) == (header.scene.digest, header.scene.mesh_digest)
}

fn contradiction<T: PartialEq + Display>(option: &str, given: Option<T>, traced: T) -> Option<String> {
    let given = given.filter(|given| *given != traced)?;
    Some(format!("`{option}` {given}, the map was traced with {traced}: leave `{option}` out"))
}

/// On or off, band by band.
fn in_words(on: &[bool]) -> String {
    on.iter().map(|&on| if on { "on" } else { "off" }).collect::<Vec<_>>().join(", ")
}
