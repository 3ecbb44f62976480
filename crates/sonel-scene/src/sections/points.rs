//! `[[sources]]` and `[[receivers]]`

use std::collections::HashMap;

use glam::DVec3;
use sonel_acoustics::Directivity;

use crate::document::Table;
use crate::report::Report;
use crate::sections::bands::BandChoice;
use crate::suggest::suggest;
use crate::{DEFAULT_POWER_LEVEL_DB, Receiver, Source};

/// A source or receiver and where its position stands in the file; `None` when the position could not be read.
pub(crate) struct Placed<T> {
    pub(crate) point: T,
    pub(crate) position_at: Option<usize>,
    pub(crate) position_path: String,
}

/// Reads the sources: at least one.
pub(crate) fn read_sources(
    document: &Table<'_>,
    bands: &BandChoice,
    report: &mut Report<'_>,
) -> Vec<Placed<Source>> {
    let Some(section) = document.get("sources") else {
        report.problem(0, "sources: missing; add a [[sources]] table with a position");
        return Vec::new();
    };
    let tables = section.tables("[[sources]]", report);
    if section.is_empty_list() {
        section.problem(report, "no source; add a [[sources]] table with a position");
    }
    let names = read_names("source", &tables, report);
    tables.iter().zip(names).map(|(table, name)| read_source(table, name, bands, report)).collect()
}

/// Reads the receivers, possibly none; without an aim of their own they look at `first_source`.
pub(crate) fn read_receivers(
    document: &Table<'_>,
    first_source: Option<DVec3>,
    report: &mut Report<'_>,
) -> Vec<Placed<Receiver>> {
    let Some(section) = document.get("receivers") else { return Vec::new() };
    let tables = section.tables("[[receivers]]", report);
    let names = read_names("receiver", &tables, report);
    let read = |(table, name): (&Table<'_>, String)| {
        table.allow_only(&["name", "position", "aim"], report);
        place_at(table, report, |position, report| {
            let towards_source = Receiver::towards(&name, position, first_source.unwrap_or(position));
            let aim = read_aim(table, report).unwrap_or(towards_source.aim);
            Receiver { aim, ..towards_source }
        })
    };
    tables.iter().zip(names).map(read).collect()
}

fn read_source(
    table: &Table<'_>,
    name: String,
    bands: &BandChoice,
    report: &mut Report<'_>,
) -> Placed<Source> {
    table.allow_only(&["name", "position", "power_level_db", "directivity", "aim"], report);
    let power_level_db = table
        .get("power_level_db")
        .and_then(|entry| Some(bands.per_band(&entry, &entry.number_or_list(report)?, report)))
        .unwrap_or_else(|| vec![DEFAULT_POWER_LEVEL_DB; bands.bands.count()]);
    if table.get("power_level_db").is_none() {
        report.note(format!("{}: {DEFAULT_POWER_LEVEL_DB} dB (default)", table.path_of("power_level_db")));
    }
    let directivity = read_directivity(table, report);
    let aim = read_aim(table, report);
    if directivity != Directivity::Omni && table.get("aim").is_none() {
        let message =
            format!("{}: missing; a {directivity} source needs aim = [x, y, z]", table.path_of("aim"));
        report.problem(table.at, message);
    }
    place_at(table, report, |position, _| Source {
        name,
        position,
        power_level_db,
        directivity,
        aim: aim.unwrap_or(DVec3::X),
    })
}

fn read_directivity(table: &Table<'_>, report: &mut Report<'_>) -> Directivity {
    let Some(entry) = table.get("directivity") else { return Directivity::Omni };
    let Some(name) = entry.text(report) else { return Directivity::Omni };
    name.parse().unwrap_or_else(|_| {
        let advice = suggest(name, Directivity::ALL.map(Directivity::name));
        entry.problem(report, &format!("unknown directivity `{name}`; {advice}"));
        Directivity::Omni
    })
}

fn read_aim(table: &Table<'_>, report: &mut Report<'_>) -> Option<DVec3> {
    let entry = table.get("aim")?;
    let aim = entry.vector(report)?.try_normalize();
    if aim.is_none() {
        entry.problem(report, "has no length; give a direction such as [1.0, 0.0, 0.0]");
    }
    aim
}

fn place_at<T>(
    table: &Table<'_>,
    report: &mut Report<'_>,
    make: impl FnOnce(DVec3, &mut Report<'_>) -> T,
) -> Placed<T> {
    let position_path = table.path_of("position");
    let entry = table.get("position");
    if entry.is_none() {
        report.problem(table.at, format!("{position_path}: missing; give position = [x, y, z] in metres"));
    }
    let position = entry.as_ref().and_then(|entry| entry.vector(report));
    let position_at = position.and(entry.map(|entry| entry.at));
    Placed { point: make(position.unwrap_or(DVec3::ZERO), report), position_at, position_path }
}

/// Names of the tables, numbered where none is given, each only once.
pub(crate) fn read_names(kind: &str, tables: &[Table<'_>], report: &mut Report<'_>) -> Vec<String> {
    let mut first_use: HashMap<String, String> = HashMap::new();
    let mut names = Vec::new();
    for (i, table) in tables.iter().enumerate() {
        let entry = table.get("name");
        let given = entry.as_ref().and_then(|entry| entry.filled_text(report));
        let name = given.map_or_else(|| format!("{kind} {}", i + 1), str::to_owned);
        let path = table.path_of("name");
        if entry.is_none() {
            report.note(format!("{path}: \"{name}\" (default)"));
        }
        if let Some(first) = first_use.get(&name) {
            let at = entry.map_or(table.at, |entry| entry.at);
            report.problem(at, format!("{path}: \"{name}\" is also {first}; give each {kind} its own name"));
        } else {
            first_use.insert(name.clone(), path);
        }
        names.push(name);
    }
    names
}
