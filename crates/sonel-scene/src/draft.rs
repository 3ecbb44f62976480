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
use crate::{Place, Problem, SceneErrors};

/// Where a source and a receiver are tried, as shares of the room's extents.
const SHARES: [f64; 7] = [0.3, 0.7, 0.5, 0.2, 0.8, 0.4, 0.6];
/// Heights above the lowest point [m], then as shares.
const SOURCE_HEIGHT: f64 = 1.5;
const RECEIVER_HEIGHT: f64 = 1.2;
/// Words of a material's name shorter than this say nothing.
const SHORTEST_WORD: usize = 3;
/// Words that are in names of any material.
const EMPTY_WORDS: [&str; 10] =
    ["wall", "walls", "room", "surface", "face", "material", "color", "colour", "layer", "default"];

/// The text of a scene file for the mesh at `path`, relative to the scene file; `open` opens it and what lies beside it.
///
/// # Errors
/// What is wrong with the mesh, or that no free place for a source was found.
pub fn draft(
    path: &str,
    name: &str,
    open: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
) -> Result<String, SceneErrors> {
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
    Ok(text)
}

/// The table of a material with the entry whose words are nearest to its name.
fn table(name: &str) -> String {
    let head = format!("\n[materials.{}]\n", quoted_key(name));
    match nearest(name) {
        Some(entry) => format!("{head}library = \"{}\"    # {}\n", entry.name, entry.text),
        None => format!(
            "{head}absorption = 0.1    # chosen: no library entry has a similar name, see sonel-trace materials\n"
        ),
    }
}

/// The entry that shares the most words with a name, the first of equals; none where it shares no word.
fn nearest(name: &str) -> Option<&'static LibraryEntry> {
    let words: Vec<String> = words(name);
    let score = |entry: &LibraryEntry| {
        let (own, text) = (crate::draft::words(&entry.name), crate::draft::words(&entry.text));
        let of_word = |word: &String| match word {
            word if own.contains(word) => 6,
            word if own
                .iter()
                .any(|own| own.starts_with(word.as_str()) || word.starts_with(own.as_str())) =>
            {
                4
            }
            word if text.contains(word) => 2,
            _ => 0,
        };
        let shared: usize = words.iter().map(of_word).sum();
        // Of equals the shorter name says less that was not asked for.
        (shared > 0).then(|| (10 * shared).saturating_sub(own.len()))
    };
    let scored = shipped()
        .iter()
        .filter(|entry| entry.absorption.is_some())
        .filter_map(|entry| Some((score(entry)?, entry)));
    scored.reduce(|best, next| if next.0 > best.0 { next } else { best }).map(|(_, entry)| entry)
}

/// Words of letters in lower case; a capital after a small letter begins one.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_small = false;
    for letter in name.chars() {
        if !letter.is_alphabetic() || (letter.is_uppercase() && was_small) {
            words.push(String::new());
        }
        was_small = letter.is_lowercase();
        if let Some(word) = words.last_mut().filter(|_| letter.is_alphabetic()) {
            word.extend(letter.to_lowercase());
        }
    }
    words.retain(|word| word.chars().count() >= SHORTEST_WORD && !EMPTY_WORDS.contains(&word.as_str()));
    words
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

    #[test]
    fn entries_are_chosen_by_their_words() {
        let found = |name: &str| nearest(name).map(|entry| entry.name.as_str());
        assert_eq!(found("Carpet_heavy_01"), Some("carpet-heavy-latex"));
        assert_eq!(found("roughConcrete"), Some("concrete-rough"));
        assert_eq!(found("GLASS-WINDOW"), Some("glass-window"));
        assert_eq!(found("Layer 12"), None);
        assert_eq!((found("walls"), found("color 3")), (None, None));
        assert_eq!(words("MyWall_02 oakFloor"), ["oak", "floor"]);
    }
}
