//! Library entries proposed for a name, and others to choose from.

use std::fmt::Write;

use crate::document::quoted_key;
use crate::library::{LibraryEntry, shipped};
use crate::words::words;

/// Plain entries for names with all these words, the first that fits.
const ORDINARY: [(&[&str], &str); 31] = [
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
    (&["fabric"], "panel-fabric-96kg"),
];
/// Mean absorption at 500 and 1000 Hz [1] above which the kind of a material decides T: plain entries for one word are guesses then. Chosen, not
/// measured; doubled, no curtain is a guess.
const ABSORBING: f64 = 0.3;
/// Hard entries for names that state a place alone.
const PLACES: [(&[&str], &str); 3] =
    [(&["floor"], "floor-concrete"), (&["ceiling"], "plaster-painted"), (&["wall"], "plaster-painted")];

/// Entries for floors, ceilings, walls and seats, a usual one first: what a designer changes.
pub(super) const FLOORS: &[&str] = &[
    "floor-linoleum",
    "floor-concrete",
    "floor-parquet",
    "carpet-thin",
    "carpet-heavy-on-concrete",
    "chairs-wooden",
    "audience-1",
];
pub(super) const CEILINGS: &[&str] = &[
    "plaster-painted",
    "plasterboard-ceiling",
    "plasterboard-perforated-16",
    "ceiling-mineral-tile-fixed",
    "ceiling-mineral-tile-suspended",
];
pub(super) const WALLS: &[&str] = &[
    "plaster-painted",
    "concrete-block-painted",
    "plasterboard-13mm-empty",
    "wood-lining-12mm",
    "glass-window",
    "panel-fabric-96kg",
];
const SEATS: &[&str] = &["chairs-light", "chairs-wooden", "chairs-medium", "audience-wooden-2", "audience"];

/// The line `library = …` of an entry, and the other ones of a list as comments, each with α at 500 Hz.
pub(super) fn choices(chosen: &str, list: &[&str]) -> String {
    let mut text = String::new();
    let others = list.iter().filter(|name| **name != chosen).map(|name| (*name, "# "));
    for (name, mark) in std::iter::once((chosen, "")).chain(others) {
        let Some(entry) = shipped().iter().find(|entry| entry.name == name) else { continue };
        let _ = writeln!(text, "{mark}library = \"{name}\"    # {}", described(entry));
    }
    text
}

/// An entry in words, with α at 500 Hz.
fn described(entry: &LibraryEntry) -> String {
    let absorption = entry.absorption.as_ref().map_or(0.0, |octaves| octaves.at(500.0).0);
    format!("{}, α {absorption:.2} at 500 Hz", entry.text)
}

/// The list of what may be put in the place of a material, by its words and the kind of its entry.
fn alternatives(words: &[String], entry: &LibraryEntry) -> &'static [&'static str] {
    let has = |wanted: &str| words.iter().any(|word| word == wanted);
    match entry.group.as_str() {
        _ if has("ceiling") || entry.group == "ceiling" => CEILINGS,
        _ if has("floor") => FLOORS,
        "floor" | "carpet" => FLOORS,
        "seating" | "audience" => SEATS,
        _ if has("wall") => WALLS,
        "masonry" | "plaster" | "plasterboard" => WALLS,
        _ => &[],
    }
}

/// The table of a material with an entry for its name, and others to choose from.
pub(super) fn table(name: &str) -> String {
    let head = format!("\n[materials.{}]\n", quoted_key(name));
    let words = words(name);
    let line = |entry: &LibraryEntry, guess: &str| {
        let mut lines = format!("{head}library = \"{}\"    # {guess}{}\n", entry.name, described(entry));
        // The first line is that of the entry itself.
        for other in choices(&entry.name, alternatives(&words, entry)).lines().skip(1) {
            let _ = writeln!(lines, "{other}");
        }
        lines
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What a drafted table proposes for a name: an entry, "?" before a guess.
    fn proposed(name: &str) -> String {
        let table = table(name);
        let guess = if table.contains("# guess") { "?" } else { "" };
        let value = table.lines().nth(2).unwrap().split(['=', '#']).nth(1).unwrap();
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
            ("screens fabric", "?panel-fabric-96kg"),
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
        let listed = ORDINARY.iter().chain(&PLACES).map(|(_, entry)| entry);
        for entry in listed.chain([FLOORS, CEILINGS, WALLS, SEATS].into_iter().flatten()) {
            let found = shipped().iter().find(|shipped| shipped.name == *entry);
            assert!(found.is_some_and(|found| found.absorption.is_some()), "{entry}");
        }
    }
}
