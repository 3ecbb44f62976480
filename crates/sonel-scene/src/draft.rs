//! A first scene file for a mesh: every material found, the nearest library entry, a source and a receiver in the room.

use std::fmt::Write;
use std::io;

use glam::DVec3;
use sonel_geometry::Geometry;

use crate::document::{quoted, quoted_key};
use crate::formats;
use crate::library::{LibraryEntry, shipped};
use crate::load::attempt;
use crate::notation::number;
use crate::words::words;
use crate::{Place, Problem, SceneErrors};

/// Positions at which a source and a receiver are tried, as shares of the room's extents: off the middle, where modes and images coincide, first.
const SHARES: [f64; 7] = [0.3, 0.7, 0.5, 0.2, 0.8, 0.4, 0.6];
/// Height of a source above the lowest point [m] (ISO 3382-1: 1.5 m), then as [`SHARES`].
const SOURCE_HEIGHT: f64 = 1.5;
/// Height of a receiver above the lowest point [m]: the ears of a seated listener (ISO 3382-1: 1.2 m), then as [`SHARES`].
const RECEIVER_HEIGHT: f64 = 1.2;
/// Plain entries for names with all these words, the first that fits.
const ORDINARY: [(&[&str], &str); 30] = [
    (&["curtain", "wall"], "glass-pane-thick"),
    (&["ceiling", "tile"], "ceiling-mineral-tile-suspended"),
    (&["acoustic", "ceiling"], "ceiling-mineral-tile-suspended"),
    (&["acoustic", "panel"], "panel-fabric-96kg"),
    (&["perforated"], "plasterboard-perforated-16"),
    (&["carpet"], "carpet-heavy-on-concrete"),
    (&["curtain"], "curtain-folded-at-wall"),
    (&["blind"], "blinds-half-open"),
    (&["people"], "audience"),
    (&["chair"], "chairs-light"),
    (&["wool"], "rock-wool-50mm-40kg"),
    (&["grass"], "soil-covered"),
    (&["soil"], "soil-bare"),
    (&["gravel"], "ballast-32mm-150mm"),
    (&["window"], "glass-window"),
    (&["glass"], "glass-pane-thick"),
    (&["door"], "door-wooden"),
    (&["plasterboard"], "plasterboard-13mm-empty"),
    (&["parquet"], "floor-parquet"),
    (&["linoleum"], "floor-linoleum"),
    (&["vinyl"], "floor-vinyl"),
    (&["rubber"], "floor-rubber-5mm"),
    (&["terrazzo"], "floor-terrazzo"),
    (&["tile"], "ceramic-tiles"),
    (&["brick"], "brick-unglazed"),
    (&["stone"], "limestone"),
    (&["concrete", "block"], "concrete-block-painted"),
    (&["concrete"], "concrete-smooth"),
    (&["plaster"], "plaster-painted"),
    (&["metal"], "hard-surfaces"),
];
/// Mean absorption at 500 and 1000 Hz [1] above which the kind of a material decides T: plain entries for one word are guesses then. Chosen, not
/// measured; doubled, no curtain is a guess.
const ABSORBING: f64 = 0.3;
/// Hard entries for names that state a place alone.
const PLACES: [(&[&str], &str); 3] =
    [(&["floor"], "floor-concrete"), (&["ceiling"], "plaster-painted"), (&["wall"], "plaster-painted")];

/// A first scene file.
#[derive(Debug)]
pub struct Draft {
    /// Text of the scene file.
    pub text: String,
    /// Likely mistakes of the mesh, as in a checkup: one sentence each.
    pub warnings: Vec<String>,
}

/// A scene file for the mesh at `path`, relative to the scene file; `open` opens it and what lies beside it.
///
/// # Errors
/// What is wrong with the mesh, or that no free place for a source was found.
pub fn draft(
    path: &str,
    name: &str,
    open: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
) -> Result<Draft, SceneErrors> {
    let whole = |message: String| {
        let place = Place { file: path.to_owned(), line: 0, column: 1 };
        SceneErrors { problems: vec![Problem { place, message }] }
    };
    let bytes = open(path).map_err(|error| whole(format!("cannot be read: {error}")))?;
    let polygons = formats::read(path, &bytes, open).map_err(|problems| SceneErrors {
        problems: problems
            .into_iter()
            .map(|problem| Problem {
                place: Place { file: path.to_owned(), line: problem.line, column: 1 },
                message: problem.message,
            })
            .collect(),
    })?;
    let mut names: Vec<&str> = polygons.names.iter().map(|name| name.name.as_str()).collect();
    names.sort_unstable();
    let mut text = format!("name = {}\nmesh = {}\n", quoted(name), quoted(path));
    let tables: String = names.iter().map(|name| table(name)).collect();
    // Read once without positions: where the room is decides them.
    let tried = attempt(&format!("{text}{tables}"), path, open)?;
    let unfit = |problem: &Problem| problem.place.line != 1 || !problem.message.starts_with("sources");
    let problems: Vec<Problem> = tried.problems.into_iter().filter(unfit).collect();
    let Some(geometry) = tried.geometry.filter(|_| problems.is_empty()) else {
        return Err(SceneErrors { problems });
    };
    for warning in &tried.remarks.warnings {
        let _ = writeln!(text, "# {warning}");
    }
    let up = tried.scene.up;
    let source = free_place(&geometry, up, SOURCE_HEIGHT, &[])
        .ok_or_else(|| whole("no free place for a source".to_owned()))?;
    let receiver = free_place(&geometry, up, RECEIVER_HEIGHT, &[source]);
    text += &tables;
    let _ = write!(text, "\n[[sources]]\nname = \"source\"\nposition = {}\n", vector(source));
    if let Some(receiver) = receiver {
        let _ = write!(text, "\n[[receivers]]\nname = \"receiver\"\nposition = {}\n", vector(receiver));
    }
    Ok(Draft { text, warnings: tried.remarks.warnings })
}

/// The table of a material with an entry for its name.
fn table(name: &str) -> String {
    let head = format!("\n[materials.{}]\n", quoted_key(name));
    let words = words(name);
    let line = |entry: &LibraryEntry, guess: &str| {
        format!("{head}library = \"{}\"    # {guess}{}\n", entry.name, entry.text)
    };
    match nearest(&words) {
        Some(entry) if is_guess(entry, &words) => {
            return line(entry, "guess, the name does not say which kind: ");
        }
        Some(entry) => return line(entry, ""),
        None => {}
    }
    if let Some(entry) = listed(&PLACES, &words) {
        return line(entry, "guess, the name states no material: ");
    }
    format!(
        "{head}absorption = 0.1    # guess: no library entry has a similar name, see sonel-trace materials\n"
    )
}

/// The entry for the words of a name: one that states nothing else, else a plain one. An entry of a single word comes last: another word of
/// the name may say more.
fn nearest(words: &[String]) -> Option<&'static LibraryEntry> {
    let shared = |entry: &LibraryEntry| {
        let own = crate::words::words(&entry.name);
        own.iter().all(|word| words.contains(word)).then_some(own.len()).filter(|shared| *shared > 0)
    };
    let stated = shipped()
        .iter()
        .filter(|entry| entry.absorption.is_some())
        .filter_map(|entry| Some((shared(entry)?, entry)))
        .reduce(|best, next| if next.0 > best.0 { next } else { best });
    match stated {
        Some((shared, entry)) if shared > 1 => Some(entry),
        stated => listed(&ORDINARY, words).or(stated.map(|(_, entry)| entry)),
    }
}

/// Whether `entry`, which a single one of `words` led to, absorbs much and says more than that word.
fn is_guess(entry: &LibraryEntry, words: &[String]) -> bool {
    let own = crate::words::words(&entry.name);
    let shared = own.iter().filter(|word| words.contains(word)).count();
    let octaves = entry.absorption.as_ref();
    let mean = octaves.map_or(0.0, |octaves| 0.5 * (octaves.at(500.0).0 + octaves.at(1000.0).0));
    shared <= 1 && own.len() > 1 && mean > ABSORBING
}

/// The entry of the first row whose words all are in a name.
fn listed(rows: &[(&[&str], &str)], words: &[String]) -> Option<&'static LibraryEntry> {
    let is_in_name = |wanted: &&str| words.iter().any(|word| word == wanted);
    let (_, found) = rows.iter().find(|(wanted, _)| wanted.iter().all(&is_in_name))?;
    shipped().iter().find(|entry| entry.name == *found)
}

/// A free place at a height [m] over the lowest point, or somewhere in between; `taken` are the positions of sources.
fn free_place(geometry: &Geometry, up: DVec3, height: f64, taken: &[DVec3]) -> Option<DVec3> {
    let (low, high) = geometry.bounds();
    let extents = high - low;
    let tall = extents.dot(up);
    let heights =
        [height].into_iter().filter(|height| *height < tall).chain(SHARES.map(|share| share * tall));
    let far_enough =
        |place: &DVec3| taken.iter().all(|taken| taken.distance(*place) > 0.1 * extents.max_element());
    let is_free = |place: &DVec3| {
        let is_in_room = !geometry.is_closed_room() || geometry.contains(*place);
        is_in_room && far_enough(place) && geometry.check_place(*place, taken).is_ok()
    };
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
    places.map(place).find(is_free)
}

fn vector(point: DVec3) -> String {
    format!("[{}]", point.to_array().map(number).join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a drafted table proposes for a name: an entry, "?" before a guess.
    fn proposed(name: &str) -> String {
        let table = table(name);
        let guess = if table.contains("# guess") { "?" } else { "" };
        let value = table.lines().last().unwrap().split(['=', '#']).nth(1).unwrap();
        format!("{guess}{}", value.trim().trim_matches('"'))
    }

    #[test]
    fn ordinary_names_get_plain_entries() {
        for (name, entry) in [
            ("plaster", "plaster-painted"),
            ("Plaster_white", "plaster-painted"),
            ("acoustic plaster", "acoustic-plaster"),
            ("concrete", "concrete-smooth"),
            ("roughConcrete", "concrete-rough"),
            ("Painted concrete", "concrete-painted"),
            ("concrete floor", "floor-concrete"),
            ("brick", "brick-unglazed"),
            ("painted brickwork", "brickwork-painted"),
            ("glass", "glass-pane-thick"),
            ("Windows", "glass-window"),
            ("GLASS-WINDOW", "glass-window"),
            ("curtain wall", "glass-pane-thick"),
            ("door", "door-wooden"),
            ("carpet", "carpet-heavy-on-concrete"),
            ("Carpet_heavy_01", "carpet-heavy-on-concrete"),
            ("Curtains", "?curtain-folded-at-wall"),
            ("velvet curtain", "curtain-velvet"),
            ("wood floor", "floor-wood"),
            ("oakFloor", "floor-wood"),
            ("parquet", "floor-parquet"),
            ("Wooden tables", "wood-50mm"),
            ("seats", "?chairs-light"),
            ("chair", "?chairs-light"),
            ("wooden seats", "chairs-wooden"),
            ("audience", "audience"),
            ("gypsum board", "plasterboard-13mm-empty"),
            ("Plasterboard", "plasterboard-13mm-empty"),
            ("plasterboard ceiling", "plasterboard-ceiling"),
            ("tiles", "ceramic-tiles"),
            ("acoustic tile", "acoustic-tile-13mm"),
            ("Acoustic ceiling tiles", "acoustic-tile-13mm"),
            ("ceiling tiles", "ceiling-mineral-tile-suspended"),
            ("marble", "marble"),
            ("Linoleum floor", "floor-linoleum"),
            ("metal", "hard-surfaces"),
            ("perforated panel", "?plasterboard-perforated-16"),
            ("glass wool", "?rock-wool-50mm-40kg"),
            ("gras", "?soil-covered"),
            ("grass", "?soil-covered"),
            ("water", "water"),
            ("hall walls", "?plaster-painted"),
            ("hall ceiling", "?plaster-painted"),
            ("foyer ceiling", "?plaster-painted"),
            ("ceiling", "?plaster-painted"),
            ("walls", "?plaster-painted"),
            ("hall floor", "?floor-concrete"),
            ("desk", "?0.1"),
            ("Layer 12", "?0.1"),
            ("color 3", "?0.1"),
        ] {
            assert_eq!(proposed(name), entry, "{name}");
        }
    }

    #[test]
    fn every_listed_entry_is_in_the_library() {
        for (words, entry) in ORDINARY.iter().chain(&PLACES) {
            let found = shipped().iter().find(|shipped| shipped.name == *entry);
            assert!(found.is_some_and(|found| found.absorption.is_some()), "{words:?}: {entry}");
        }
    }
}
