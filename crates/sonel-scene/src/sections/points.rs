//! `[[sources]]` and `[[receivers]]`

use std::collections::HashMap;
use std::ops::RangeInclusive;

use glam::DVec3;
use sonel_acoustics::{Balloon, Directivity, Pattern, SourceChange, TALKER, talker};

use crate::balloon_file;
use crate::bands::BandChoice;
use crate::document::{Entry, Table};
use crate::sections::walls::OpenMesh;
use crate::suggest::suggest;
use crate::{DEFAULT_POWER_LEVEL_DB, Receiver, Source};

/// A source, a receiver or a region, where its table stands in the file, and its position.
pub(crate) struct Placed<T> {
    pub(crate) point: T,
    pub(crate) at: usize,
    pub(crate) spot: Spot,
}

/// A position, its full key, and where it stands in the file; [`None`] when it could not be read.
pub(crate) struct Spot {
    pub(crate) position: DVec3,
    pub(crate) path: String,
    pub(crate) at: Option<usize>,
}

/// Advice on a missing position.
const PLACE_IT: &str = "give position = [x, y, z] in metres";

/// Reads the sources: at least one.
pub(crate) fn read_sources(
    document: &Table<'_>,
    bands: &BandChoice,
    up: DVec3,
    open: OpenMesh<'_>,
) -> Vec<Placed<Source>> {
    let Some(section) = document.get("sources") else {
        document.report.problem(0, "sources: missing; add a [[sources]] table with a position");
        return Vec::new();
    };
    let tables = section.tables("[[sources]]");
    if section.is_empty_list() {
        section.problem("no source; add a [[sources]] table with a position");
    }
    let names = read_names("source", &tables);
    tables.iter().zip(names).map(|(table, name)| read_source(table, name, bands, up, open)).collect()
}

/// Reads the receivers, possibly none; without an aim of their own they look at `first_source`.
pub(crate) fn read_receivers(document: &Table<'_>, first_source: Option<DVec3>) -> Vec<Placed<Receiver>> {
    let Some(section) = document.get("receivers") else { return Vec::new() };
    let tables = section.tables("[[receivers]]");
    let names = read_names("receiver", &tables);
    let read = |(table, name): (&Table<'_>, String)| {
        table.allow_only(&["name", "position", "directivity", "aim"]);
        let entry = table.get("directivity");
        let pattern = entry.and_then(|entry| read_pattern(&entry, &[])).unwrap_or_default();
        if pattern != Pattern::Omni && first_source.is_none() && table.get("aim").is_none() {
            table.missing("aim", &format!("a {pattern} receiver needs aim = [x, y, z]"));
        }
        place_at(table, "position", PLACE_IT, |position| {
            let towards_source = Receiver::towards(&name, position, first_source.unwrap_or(position));
            let unstated = if first_source.is_some() { towards_source.aim } else { DVec3::ZERO };
            let aim = read_direction(table, "aim").unwrap_or(unstated);
            Receiver { aim, pattern, ..towards_source }
        })
    };
    tables.iter().zip(names).map(read).collect()
}

fn read_source(
    table: &Table<'_>,
    name: String,
    bands: &BandChoice,
    up: DVec3,
    open: OpenMesh<'_>,
) -> Placed<Source> {
    let known = ["name", "position", "power_level_db", "directivity", "aim", "up", "gain_db", "delay_s"];
    table.allow_only(&known);
    let power_level_db = table
        .get("power_level_db")
        .and_then(|entry| Some(bands.per_band(&entry, &entry.number_or_list()?)))
        .unwrap_or_else(|| vec![DEFAULT_POWER_LEVEL_DB; bands.bands.count()]);
    if table.get("power_level_db").is_none() {
        table
            .report
            .default(format!("{}: {DEFAULT_POWER_LEVEL_DB} dB (default)", table.path_of("power_level_db")));
    }
    let aim = read_direction(table, "aim");
    let directivity = read_directivity(table, bands, up, aim, open);
    let change = SourceChange {
        gain_db: read_within(table, "gain_db", SourceChange::GAINS_DB, "dB"),
        delay: read_within(table, "delay_s", SourceChange::DELAYS, "s"),
    };
    place_at(table, "position", PLACE_IT, |position| Source {
        name,
        position,
        power_level_db,
        directivity,
        aim: aim.unwrap_or(DVec3::X),
        change,
    })
}

/// A number within `range`, 0 where the key is left out.
fn read_within(table: &Table<'_>, key: &str, range: RangeInclusive<f64>, unit: &str) -> f64 {
    let Some(entry) = table.get(key) else { return 0.0 };
    let Some(number) = entry.number() else { return 0.0 };
    if !range.contains(&number.value) {
        let (low, high) = range.into_inner();
        entry.problem(&format!("{} {unit} is outside {low} … {high} {unit}", number.value));
        return 0.0;
    }
    number.value
}

fn read_directivity(
    table: &Table<'_>,
    bands: &BandChoice,
    up: DVec3,
    aim: Option<DVec3>,
    open: OpenMesh<'_>,
) -> Directivity {
    let entry = table.get("directivity");
    let value = entry.as_ref().and_then(|entry| Some((entry, entry.text()?)));
    let file = value.filter(|(_, value)| balloon_file::is_balloon_file(value));
    let is_talker = value.is_some_and(|(_, value)| value == TALKER);
    let pattern = match (&file, &entry) {
        (None, Some(entry)) if !is_talker => read_pattern(entry, &[TALKER]).unwrap_or_default(),
        _ => Pattern::Omni,
    };
    if let (None, Some(aim)) = (&entry, table.get("aim")) {
        aim.problem("a source without directivity is omnidirectional and has no aim; add directivity, or remove this key");
    }
    if (file.is_some() || is_talker || pattern != Pattern::Omni) && table.get("aim").is_none() {
        let word = if is_talker { TALKER } else { pattern.name() };
        let kind = file.map_or(word, |_| "directional");
        table.missing("aim", &format!("a {kind} source needs aim = [x, y, z]"));
    }
    let stated = read_direction(table, "up");
    let Some((entry, path)) = file else {
        if let Some(up) = table.get("up") {
            up.problem("only a directivity from a file has an upper side; remove the key");
        }
        return match aim.filter(|_| is_talker) {
            // The same around the aim: no side is up.
            Some(aim) => Directivity::measured(talker(&bands.bands), aim, up).unwrap_or(Directivity::OMNI),
            None => pattern.into(),
        };
    };
    let Some(balloon) = read_balloon(entry, path, bands, open) else { return Directivity::OMNI };
    let Some(aim) = aim else { return Directivity::OMNI };
    // Without an upper side where aim and up are parallel and azimuths differ.
    Directivity::measured(balloon, aim, stated.unwrap_or(up)).unwrap_or_else(|| {
        let at = table.get("up").map_or(table.at, |up| up.at);
        let problem = "is parallel to aim: give up = [x, y, z], a direction across the aim";
        table.report.problem(at, format!("{}: {problem}", table.path_of("up")));
        Directivity::OMNI
    })
}

fn read_balloon(entry: &Entry<'_>, path: &str, bands: &BandChoice, open: OpenMesh<'_>) -> Option<Balloon> {
    let bytes = entry.file(path, open)?;
    let (balloon, notes) = entry.report.sound(path, balloon_file::read(path, &bytes, &bands.bands))?;
    notes.into_iter().for_each(|note| entry.report.note(format!("{}: `{path}`: {note}", entry.path)));
    Some(balloon)
}

/// A pattern; `others` are words that are none but known.
fn read_pattern(entry: &Entry<'_>, others: &[&str]) -> Option<Pattern> {
    let name = entry.text()?;
    let pattern = name.parse().ok();
    if pattern.is_none() {
        let known = Pattern::ALL.map(Pattern::name).into_iter().chain(others.iter().copied());
        let advice = suggest(name, known);
        entry.problem(&format!("unknown directivity `{name}`; {advice}"));
    }
    pattern
}

fn read_direction(table: &Table<'_>, key: &str) -> Option<DVec3> {
    let entry = table.get(key)?;
    let direction = entry.vector()?.try_normalize();
    if direction.is_none() {
        entry.problem("has no length; give a direction such as [1.0, 0.0, 0.0]");
    }
    direction
}

/// What `make` makes of the position under `key`; `advice` is for one that is missing.
pub(crate) fn place_at<T>(
    table: &Table<'_>,
    key: &str,
    advice: &str,
    make: impl FnOnce(DVec3) -> T,
) -> Placed<T> {
    let entry = table.get(key);
    if entry.is_none() {
        table.missing(key, advice);
    }
    let found = entry.and_then(|entry| Some((entry.vector()?, entry.at)));
    let position = found.map_or(DVec3::ZERO, |(position, _)| position);
    let spot = Spot { position, path: table.path_of(key), at: found.map(|(_, at)| at) };
    Placed { point: make(position), at: table.at, spot }
}

/// Names of the tables, numbered where none is given, each only once.
pub(crate) fn read_names(kind: &str, tables: &[Table<'_>]) -> Vec<String> {
    let mut first_use: HashMap<String, String> = HashMap::new();
    let mut names = Vec::new();
    for (i, table) in tables.iter().enumerate() {
        let entry = table.get("name");
        let given = entry.as_ref().and_then(|entry| entry.filled_text());
        let name = given.map_or_else(|| format!("{kind} {}", i + 1), str::to_owned);
        let path = table.path_of("name");
        if entry.is_none() {
            table.report.default(format!("{path}: \"{name}\" (default)"));
        }
        if let Some(first) = first_use.get(&name) {
            let at = entry.map_or(table.at, |entry| entry.at);
            table
                .report
                .problem(at, format!("{path}: \"{name}\" is also {first}; give each {kind} its own name"));
        } else {
            first_use.insert(name.clone(), path);
        }
        names.push(name);
    }
    names
}
