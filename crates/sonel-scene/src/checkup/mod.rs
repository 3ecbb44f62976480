//! Checkup of a scene before tracing: sizes, statistical times, problems, faults of the mesh.
//!
//! Nothing is traced. Sizes, statistical reverberation times and areas come from the scene as far as it could be read; problems,
//! warnings and faults of the mesh are collected. A mesh with holes or crossing faces can still be traced.
//!
//! References: [Sabine1922], [Eyring1930], [Schroeder1962] (docs/references.md).

mod faults;
mod repaired;
pub(crate) mod scattering;

use std::io;
use std::sync::Arc;

pub use repaired::{FIRST_LINE, Repaired};

use glam::DVec3;
use sonel_acoustics::{
    equivalent_absorption_area, eyring_time, mean_absorption, mean_free_path, sabine_time,
    schroeder_frequency,
};
use sonel_geometry::{CellPlace, Geometry};

use crate::load::{Attempt, attempt};
use crate::report::{NoteKind, Remarks};
use crate::room::leak;
use crate::{Document, Problem, Scene, SceneErrors};

/// Findings of a checkup.
#[derive(Debug)]
pub struct Checkup {
    /// Why the scene cannot be traced.
    pub problems: Vec<Problem>,
    /// Likely mistakes: one sentence each.
    pub warnings: Vec<String>,
    /// Faults of the mesh with their places: one sentence each.
    pub faults: Vec<String>,
    /// Repairs made, what else is of note: one sentence each.
    pub notes: Vec<String>,
    /// Defaults taken: one sentence each ([`crate::folded`] makes one of them).
    pub defaults: Vec<String>,
    /// Repairs of the mesh, of those notes and faults.
    pub repairs: Vec<String>,
    /// The room, where its walls could be read.
    pub room: Option<Room>,
    /// The mesh as it is traced, where the walls could be read.
    pub repaired: Option<Repaired>,
    /// The scene and its walls, where nothing is wrong that stops a trace.
    pub traceable: Option<(Scene, Arc<Geometry>)>,
}

/// Sizes of a room and its statistical reverberation.
#[derive(Clone, Debug)]
pub struct Room {
    /// Extents of the box about the room [m].
    pub extents: DVec3,
    /// Volume of the air [m³]; none where the mesh is no closed room.
    pub volume: Option<f64>,
    /// Area exposed to the air [m²].
    pub area: f64,
    /// 4 V / S [m], of a closed room.
    pub mean_free_path: Option<f64>,
    /// Below it room modes matter [Hz]; of a closed room, with the longest Sabine time.
    pub schroeder_frequency: Option<f64>,
    /// Triangles and planar surfaces.
    pub counts: [usize; 2],
    /// Materials by area, the largest first.
    pub coverings: Vec<Covering>,
    /// One for each band of a closed room whose materials are all known.
    pub times: Vec<Times>,
    /// Where sound can be, the largest part first.
    pub airs: Vec<Air>,
}

/// A part of the air that no wall divides.
#[derive(Clone, Debug)]
pub struct Air {
    /// Volume [m³]; none of the outside, which has no bounds.
    pub volume: Option<f64>,
    /// A place in it [m]; none of the outside.
    pub place: Option<DVec3>,
    /// Names of the materials around it, the largest area first.
    pub materials: Vec<String>,
    /// Names of the sources and receivers in it.
    pub points: Vec<String>,
}

/// A material and where it is.
#[derive(Clone, Debug)]
pub struct Covering {
    /// Name.
    pub name: String,
    /// Area exposed to the air [m²].
    pub area: f64,
    /// α per band; none where no table of the scene defines it.
    pub absorption: Option<Vec<f64>>,
}

/// Statistical reverberation in a band.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    /// Nominal centre [Hz].
    pub center_hz: f64,
    /// Mean absorption coefficient, weighted by area.
    pub mean_absorption: f64,
    /// Sabine's time [s].
    pub sabine: f64,
    /// Eyring's time [s].
    pub eyring: f64,
}

impl Checkup {
    /// Whether something needs a look.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.problems.is_empty() && self.warnings.is_empty() && self.faults.is_empty()
    }
}

/// Checks a scene file; the arguments are those of [`crate::load`].
///
/// # Errors
/// When the text is no TOML.
pub fn check(
    toml_text: &str,
    file_label: &str,
    open_mesh: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
) -> Result<Checkup, SceneErrors> {
    Ok(checked(attempt(toml_text, file_label, open_mesh, None)?))
}

impl Document {
    /// Checks the scene as [`check`] does its file.
    #[must_use]
    pub fn check(&self) -> Checkup {
        checked(self.attempt())
    }
}

fn checked(attempt: Attempt) -> Checkup {
    let room = attempt.geometry.as_ref().map(|geometry| room(&attempt, geometry));
    let repaired = attempt.geometry.as_ref().map(|geometry| Repaired::of(geometry, names(&attempt)));
    let mut faults =
        attempt.geometry.as_ref().map_or(Vec::new(), |geometry| faults::of(geometry, &attempt.scene));
    let Remarks { notes: all, warnings } = attempt.remarks;
    let of_kind = |kinds: [NoteKind; 2]| -> Vec<String> {
        all.iter().filter(|note| kinds.contains(&note.kind)).map(|note| note.text.clone()).collect()
    };
    let repairs = of_kind([NoteKind::Repair, NoteKind::RepairedFault]);
    // Holes are listed one by one.
    let leak = attempt.geometry.as_deref().map_or(String::new(), leak);
    let is_leak = |note: &String| !leak.is_empty() && note.ends_with(&leak);
    faults.extend(of_kind([NoteKind::Fault, NoteKind::RepairedFault]).into_iter().filter(|it| !is_leak(it)));
    let defaults = of_kind([NoteKind::Default; 2]);
    let mut notes = of_kind([NoteKind::Plain, NoteKind::Repair]);
    let traceable = attempt.geometry.filter(|_| attempt.problems.is_empty());
    let traceable = traceable.map(|geometry| (attempt.scene, geometry));
    notes.extend(traceable.iter().flat_map(|(scene, geometry)| scattering::advice(scene, geometry)));
    Checkup {
        problems: attempt.problems,
        warnings,
        faults,
        notes,
        defaults,
        repairs,
        room,
        repaired,
        traceable,
    }
}

/// Names of the materials, then of those that the scene lacks.
fn names(attempt: &Attempt) -> impl Iterator<Item = &String> {
    attempt.scene.materials.iter().map(|material| &material.name).chain(&attempt.unknown)
}

fn room(attempt: &Attempt, geometry: &Geometry) -> Room {
    let (low, high) = geometry.bounds();
    let covering = |(index, name): (u32, &String)| Covering {
        name: name.clone(),
        area: geometry.exposed_area(index),
        absorption: attempt.scene.materials.get(index as usize).map(|material| material.absorption.clone()),
    };
    let mut coverings: Vec<Covering> =
        (0u32..).zip(names(attempt)).map(covering).filter(|covering| covering.area > 0.0).collect();
    coverings.sort_by(|a, b| b.area.total_cmp(&a.area));
    let is_known = |problem: &Problem| {
        ["sources", "receivers"].iter().any(|section| problem.message.starts_with(section))
    };
    let volume = geometry.volume().filter(|volume| *volume > 0.0);
    let times = match volume {
        Some(volume) if attempt.problems.iter().all(is_known) => times(&attempt.scene, &coverings, volume),
        _ => Vec::new(),
    };
    let longest = times.iter().map(|times| times.sabine).filter(|time| time.is_finite()).fold(0.0, f64::max);
    Room {
        extents: high - low,
        volume,
        area: geometry.area(),
        mean_free_path: volume.map(|volume| mean_free_path(volume, geometry.area())),
        schroeder_frequency: volume
            .filter(|_| longest > 0.0)
            .map(|volume| schroeder_frequency(longest, volume)),
        airs: airs(attempt, geometry),
        counts: [geometry.mesh().triangles.len(), geometry.surfaces().len()],
        coverings,
        times,
    }
}

fn airs(attempt: &Attempt, geometry: &Geometry) -> Vec<Air> {
    let names: Vec<&String> = names(attempt).collect();
    let Scene { sources, receivers, .. } = &attempt.scene;
    let points = sources.iter().map(|it| (&it.name, it.position));
    let points: Vec<(&String, u32)> = points
        .chain(receivers.iter().map(|it| (&it.name, it.position)))
        .map(|(name, position)| (name, geometry.cell_at(position)))
        .collect();
    let coverings = geometry.coverings();
    let air = |cell: u32, found: Option<CellPlace>| {
        let mut areas: Vec<(&u32, &f64)> = coverings.get(&cell).into_iter().flatten().collect();
        areas.sort_by(|a, b| b.1.total_cmp(a.1));
        Air {
            volume: found.map(|found| found.volume),
            place: found.map(|found| found.place),
            materials: areas.iter().map(|(material, _)| names[**material as usize].clone()).collect(),
            points: points.iter().filter(|(_, at)| *at == cell).map(|(name, _)| (*name).clone()).collect(),
        }
    };
    let outside = (!geometry.is_closed_room()).then(|| air(0, None));
    let bounded = geometry.air_cells().into_iter().map(|cell| air(cell.number, Some(cell)));
    outside.into_iter().chain(bounded).collect()
}

fn times(scene: &Scene, coverings: &[Covering], volume: f64) -> Vec<Times> {
    let area: f64 = coverings.iter().map(|covering| covering.area).sum();
    let of_band = |(band, center_hz): (usize, &f64)| {
        let absorption =
            |covering: &Covering| covering.absorption.as_ref().map_or(0.0, |absorption| absorption[band]);
        let walls = || coverings.iter().map(|covering| (covering.area, absorption(covering)));
        let (air, speed) = (scene.air_attenuation[band], scene.speed_of_sound);
        let mean = mean_absorption(walls());
        Times {
            center_hz: *center_hz,
            mean_absorption: mean,
            sabine: sabine_time(volume, equivalent_absorption_area(walls()), air, speed),
            eyring: eyring_time(volume, area, mean, air, speed),
        }
    };
    scene.bands.nominal().iter().enumerate().map(of_band).collect()
}
