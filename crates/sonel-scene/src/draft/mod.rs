//! A first scene file for a mesh or a rectangular room: materials with entries to choose from, a source, receivers, a target.

mod axes;
mod proposal;
mod purpose;
mod shoebox;

use std::collections::HashSet;
use std::fmt::Write;
use std::io;
use std::sync::Arc;

use glam::DVec3;
use sonel_geometry::{CellPlace, Departure, Geometry};

use crate::checkup::scattering;
use crate::document::{quoted, quoted_key};
use crate::formats;
use crate::load::{Attempt, attempt};
use crate::notation::{self, count, number, place};
use crate::obj::Polygons;
use crate::problem::LineProblem;
use crate::scene::default_duration;
use crate::sections::walls::UNITS;
use crate::{Scene, SceneErrors};
use proposal::table;
pub use purpose::Purpose;
pub use shoebox::draft_shoebox;

/// Positions at which a source and a receiver are tried, as shares of the room's extents: off the middle, where modes and images coincide, first.
const SHARES: [f64; 7] = [0.3, 0.7, 0.5, 0.2, 0.8, 0.4, 0.6];
/// Height of a source above the lowest point [m] (ISO 3382-1: 1.5 m), then as [`SHARES`].
const SOURCE_HEIGHT: f64 = 1.5;
/// Height of a receiver above the lowest point [m]: the ears of a seated listener (ISO 3382-1: 1.2 m), then as [`SHARES`].
const RECEIVER_HEIGHT: f64 = 1.2;
/// A first scene file.
#[derive(Debug)]
pub struct Draft {
    /// Text of the scene file.
    pub text: String,
    /// Likely mistakes of the mesh, as in a checkup: one sentence each.
    pub warnings: Vec<String>,
    /// Unit, upward axis and target, and why: one sentence each.
    pub notes: Vec<String>,
}

/// What is known of a room before its scene file.
#[derive(Clone, Copy, Debug, Default)]
pub struct DraftOptions<'a> {
    /// What the room is for: it has a target then.
    pub purpose: Option<Purpose>,
    /// Unit of the mesh, as `mesh_unit`; by default what the file says or its sizes tell.
    pub unit: Option<&'a str>,
    /// Upward axis of the mesh, as `mesh_up`; by default what the file says or its materials tell.
    pub up: Option<&'a str>,
    /// The only room that is air, by its number from 1; by default all are, and the points are in the largest.
    pub room: Option<usize>,
}

/// A scene file for the mesh at `path`, relative to the scene file; `open` opens it and what lies beside it.
///
/// # Errors
/// What is wrong with the mesh, that its sizes fit several units, or that no free place for a source was found.
pub fn draft(
    path: &str,
    name: &str,
    options: &DraftOptions<'_>,
    open: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
) -> Result<Draft, SceneErrors> {
    let whole = |message: String| SceneErrors::of_file(path, vec![LineProblem::new(0, message)]);
    let bytes = open(path).map_err(|error| whole(format!("cannot be read: {error}")))?;
    let polygons =
        formats::read(path, &bytes, open).map_err(|problems| SceneErrors::of_file(path, problems))?;
    let axes::Axes { keys, mut notes, mut warnings } = axes::find(&polygons, options).map_err(whole)?;
    let mut names: Vec<&str> = polygons.names.iter().map(|name| name.name.as_str()).collect();
    names.sort_unstable();
    let mut text = format!("name = {}\nmesh = {}\n{keys}", quoted(name), quoted(path));
    let mut tables: String = names.iter().map(|name| table(name)).collect();
    // Read without positions: where the room is decides them.
    let mut tried = tried(&format!("{text}{tables}"), path, open)?;
    let rooms = tried.1.air_cells();
    notes.extend(listed(&rooms));
    if let Some(number) = options.room {
        let Some(room) = number.checked_sub(1).and_then(|at| rooms.get(at)) else {
            let have = count(rooms.len(), "room");
            return Err(whole(format!("room {number}: the mesh has {have}, from 1")));
        };
        text += &format!("air_at = [{}]    # room {number} alone\n", (room.place * 1e3).round() / 1e3);
        tried = self::tried(&format!("{text}{tables}"), path, open)?;
    }
    let (tried, geometry) = tried;
    for (index, list) in scattering::advised(&tried.scene, &geometry) {
        let head = format!("[materials.{}]\n", quoted_key(&tried.scene.materials[index].name));
        let line = format!("{head}scattering = {list}    # advice: docs/validation.md\n");
        tables = tables.replace(&head, &line);
    }
    warnings.extend(tried.remarks.warnings);
    let mut head =
        "# Written by sonel-trace new: check what is marked as a guess. Keys: docs/formats/scene.md\n"
            .to_owned();
    if let (Some(purpose), Some(volume)) = (options.purpose, geometry.volume()) {
        let (low, high) = geometry.bounds();
        let height = (high - low).dot(tried.scene.up.abs());
        notes.push(format!("target: {}", purpose.target(volume, height)));
    } else if options.purpose.is_some() {
        warnings.push("no target: the mesh is not a closed room and has no volume".to_owned());
    }
    for line in notes.iter().chain(&warnings) {
        let _ = writeln!(head, "# {line}");
    }
    text += &duration(&tried.scene, &geometry);
    let up = tried.scene.up;
    let [mut sources, mut receivers] =
        ["source", "receiver"].map(|kind| named_points(&polygons, options, up, kind));
    for (name, _) in sources.iter().chain(&receivers) {
        notes.push(format!("\"{name}\": at its node in the file"));
    }
    if sources.is_empty() {
        let place = free_place(&geometry, up, SOURCE_HEIGHT, &[]).ok_or_else(|| {
            let (low, high) = geometry.bounds();
            let reason = geometry.check_place(0.5 * (low + high), &[]).err();
            let middle = reason.map_or_else(String::new, |reason| format!(": the middle {reason}"));
            whole(format!("no free place for a source{middle}"))
        })?;
        sources.push(("source".to_owned(), place));
    }
    if receivers.is_empty() {
        let taken: Vec<DVec3> = sources.iter().map(|(_, place)| *place).collect();
        let place = free_place(&geometry, up, RECEIVER_HEIGHT, &taken);
        receivers.extend(place.map(|place| ("receiver".to_owned(), place)));
    }
    text += &tables;
    for (kind, points) in [("sources", sources), ("receivers", receivers)] {
        for (name, place) in points {
            let (name, place) = (quoted(&name), vector(place));
            let _ = write!(text, "\n[[{kind}]]\nname = {name}\nposition = {place}\n");
        }
    }
    Ok(Draft { text: head + &text, warnings, notes })
}

/// A scene without positions and its walls.
fn tried(
    text: &str,
    path: &str,
    open: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
) -> Result<(Attempt, Arc<Geometry>), SceneErrors> {
    let mut tried = attempt(text, path, open, None)?;
    tried.problems.retain(|problem| problem.place.line != 1 || !problem.message.starts_with("sources"));
    match tried.geometry.take().filter(|_| tried.problems.is_empty()) {
        Some(geometry) => Ok((tried, geometry)),
        None => Err(SceneErrors { problems: tried.problems }),
    }
}

/// Most rooms that are listed.
const LISTED: usize = 12;
/// Least volume of a room [m³]: a small booth. Less is a gap in the drawing.
const LEAST_ROOM: f64 = 1.0;

/// The rooms of a mesh, where it has several.
fn listed(rooms: &[CellPlace]) -> Vec<String> {
    let room = |(number, room): (usize, &CellPlace)| {
        format!(
            "room {number}: {} m³ about ({}) m",
            notation::number(room.volume),
            place((room.place * 1e3).round() / 1e3)
        )
    };
    let count = rooms.iter().filter(|room| room.volume >= LEAST_ROOM).count();
    if count < 2 { Vec::new() } else { (1..).zip(&rooms[..count]).take(LISTED).map(room).collect() }
}

/// The key `duration_s` as a comment, for it has a default; and Sabine's time of the materials, where there is one.
fn duration(scene: &Scene, geometry: &Geometry) -> String {
    let longest = scene.largest_sabine_time(geometry).filter(|_| geometry.is_closed_room());
    longest.map_or_else(String::new, |time| {
        format!(
            "# duration_s = {:.2}    # length of the echograms [s]; without it, 1.2 times the decay by 60 dB at the receivers. Longest Sabine time of these materials: {time:.2} s\n",
            default_duration(time)
        )
    })
}

/// Points of the file whose names begin with `kind`, in metres and the axes of the scene.
fn named_points(
    polygons: &Polygons,
    options: &DraftOptions<'_>,
    up: DVec3,
    kind: &str,
) -> Vec<(String, DVec3)> {
    let stated = options.unit.and_then(|unit| UNITS.into_iter().find(|(name, _)| *name == unit));
    let length = stated.map(|(_, length)| length).or(polygons.terms.unit.map(|(length, _)| length));
    let is_turned = polygons.terms.is_y_up && options.up.is_none() && up == DVec3::Z;
    let place = |point: DVec3| {
        let DVec3 { x, y, z } = point;
        let turned = if is_turned { DVec3::new(x, -z, y) } else { point };
        // Files hold single precision; a tenth of a millimetre is nearer than anybody places a source.
        (turned * length.unwrap_or(1.0) * 1e4).round() / 1e4
    };
    let mut seen = HashSet::new();
    let of_kind = polygons.points.iter().filter(|(name, _)| name.to_lowercase().starts_with(kind));
    of_kind.filter(|(name, _)| seen.insert(name)).map(|(name, point)| (name.clone(), place(*point))).collect()
}

/// A free place at a height [m] over the lowest point, or somewhere in between, in the largest room where there is one; `taken` are the positions
/// of sources, of which it shares the air.
fn free_place(geometry: &Geometry, up: DVec3, height: f64, taken: &[DVec3]) -> Option<DVec3> {
    let room = geometry.air_cells().first().copied();
    let (low, high) = room.map_or(geometry.bounds(), |room| room.bounds);
    let extents = high - low;
    let tall = extents.dot(up);
    let heights =
        [height].into_iter().filter(|height| *height < tall).chain(SHARES.map(|share| share * tall));
    // The first coordinate across changes slowest, so that source and receiver stand apart.
    let places = heights.flat_map(|height| {
        SHARES
            .into_iter()
            .flat_map(move |first| SHARES.into_iter().map(move |second| (height, first, second)))
    });
    let place = |(height, first, second): (f64, f64, f64)| {
        let across = DVec3::new(first, if up == DVec3::Y { first } else { second }, second) * extents;
        let level = across - across.dot(up) * up + height * up;
        ((low + level) * 100.0).round() / 100.0
    };
    let places: Vec<DVec3> = places.map(place).collect();
    let is_free = |place: DVec3| {
        // A source makes a room of the shell that it stands in, where no room is closed.
        let own = [place];
        let sources = if taken.is_empty() { &own } else { taken };
        let far_enough = taken.iter().all(|taken| taken.distance(place) > 0.1 * extents.max_element());
        far_enough && geometry.check_place(place, sources).is_ok()
    };
    let is_inside = |place: DVec3| geometry.cell_at(place) > 0;
    // In the open shells are buildings, if they do not fill most of it: then what is beside them is a terrace, or a sheet that sticks out.
    let is_in_shells = 2 * places.iter().filter(|&&place| is_inside(place)).count() > places.len();
    let shares_air = |place: DVec3| match taken.first() {
        Some(&source) => geometry.cell_at(place) == geometry.cell_at(source),
        None if room.is_some() => room.is_some_and(|room| geometry.cell_at(place) == room.number),
        None => is_inside(place) == is_in_shells,
    };
    let is_over_ground = |place: DVec3| {
        let from = Departure::free(geometry.to_local(place));
        geometry.closest_hit(from, -up.as_vec3()).is_some()
    };
    let wishes: [&dyn Fn(DVec3) -> bool; 3] =
        [&|place| shares_air(place) && is_over_ground(place), &is_over_ground, &|_| true];
    let best = |wish: &dyn Fn(DVec3) -> bool| places.iter().copied().find(|&at| wish(at) && is_free(at));
    wishes.into_iter().find_map(best)
}

fn vector(point: DVec3) -> String {
    format!("[{}]", point.to_array().map(number).join(", "))
}
