//! Compares two maps: changed settings, then incident energies that differ beyond noise.

use std::fmt::Write as _;
use std::io::Write;

use anyhow::Context;
use serde_json::{Value, json};
use sonel::analysis::map_comparison::{
    ArrivalPlace, CellDifference, MapComparison, MapPairing, PlaceKind, Tier, Traced, changes, compare,
};
use sonel::map::Difference;
use sonel_console::Outcome;
use sonel_console::quantity::list;

use crate::arguments::Diff;
use crate::open;

/// Lines of the listing without --list.
const LISTED: usize = 20;

/// Compares two maps; [`Outcome::Missed`] where they differ beyond noise.
///
/// # Errors
/// When a file is no valid map, the two have nothing in common that can be tested, or `out` cannot be written.
pub(super) fn run(arguments: &Diff, out: &mut dyn Write) -> anyhow::Result<Outcome> {
    let (map_a, geometry_a) = open::checked_map(&arguments.a)?;
    let (map_b, geometry_b) = open::checked_map(arguments.other())?;
    if map_a.digest() == map_b.digest() {
        let json = || json!({ "kind": "sonelmap", "same": true, "identical": true });
        arguments.printed.print(out, json, || "identical: the maps are equal byte for byte\n".to_owned())?;
        return Ok(Outcome::Done);
    }
    let changes = changes(&map_a, &map_b);
    let (a, b) =
        (Traced { map: &map_a, geometry: &geometry_a }, Traced { map: &map_b, geometry: &geometry_b });
    let comparison = compare(a, b).with_context(|| {
        format!("cannot compare {} with {}", arguments.a.display(), arguments.other().display())
    })?;
    let text = || to_text(&comparison, &changes, arguments.list);
    arguments.printed.print(out, || to_json(&comparison, &changes), text)?;
    let differ = comparison.tiers.iter().flat_map(|tier| &tier.cells).any(|cell| cell.differs);
    Ok(if differ { Outcome::Missed } else { Outcome::Done })
}

fn to_json(comparison: &MapComparison, changes: &[Difference]) -> Value {
    let tiers: Vec<Value> = comparison
        .tiers
        .iter()
        .map(|tier| {
            json!({
                "cells": plural(tier.kind),
                "tested": tier.cells.len(),
                "different": tier.cells.iter().filter(|cell| cell.differs).count(),
                "too_few_packets": tier.sparse,
                "sparse_energy": tier.sparse_energy,
                "level_per_cell": tier.level,
                "detectable_db": detectable_db(tier),
            })
        })
        .collect();
    let mut cells: Vec<&CellDifference> = comparison.tiers.iter().flat_map(|tier| &tier.cells).collect();
    cells.sort_by(|a, b| b.significance().total_cmp(&a.significance()));
    json!({
        "kind": "sonelmap",
        "same": !cells.iter().any(|cell| cell.differs),
        "identical": false,
        "changes": changes.iter()
            .map(|change| json!({ "what": change.what, "a": change.here, "b": change.there }))
            .collect::<Vec<_>>(),
        "noise": pairing(comparison.pairing),
        "without_counterpart": comparison.without_counterpart,
        "levels": tiers,
        "cells": cells.into_iter().map(cell_json).collect::<Vec<_>>(),
    })
}

fn cell_json(cell: &CellDifference) -> Value {
    let place = match &cell.place {
        ArrivalPlace::Room => json!({ "kind": "room" }),
        ArrivalPlace::Material(name) => json!({ "kind": "material", "material": name }),
        ArrivalPlace::Surface { in_a, in_b, material, area } => {
            json!({ "kind": "surface", "in_a": in_a, "in_b": in_b, "material": material, "area_m2": area })
        }
    };
    let ratio = match (cell.ratio_db, cell.interval_db) {
        (Some(value), Some(interval)) => json!({ "value": value, "ci95": interval }),
        _ => json!({ "value": null, "reason": "no energy arrives in one of the maps" }),
    };
    json!({
        "source": cell.source,
        "place": place,
        "center_frequency_hz": cell.center_frequencies_hz,
        "window_s": cell.window,
        "incident_energy": cell.incident,
        "ratio_db": ratio,
        "arrivals": cell.arrivals,
        // JSON knows no infinity: a difference without noise has no measure.
        "significance": cell.significance().is_finite().then(|| cell.significance()),
        "differs": cell.differs,
    })
}

fn to_text(comparison: &MapComparison, changes: &[Difference], list_all: bool) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    if changes.is_empty() {
        text.push_str("same program, settings and scene\n");
    }
    for change in changes {
        let _ = writeln!(text, "changed: {}: {} in A, {} in B", change.what, change.here, change.there);
    }
    for sentence in &comparison.without_counterpart {
        let _ = writeln!(text, "note: {sentence}");
    }
    let _ = writeln!(text, "noise: {}\n", pairing(comparison.pairing));
    text.push_str("                tested  differ  sparse (energy)   half the cells show changes of\n");
    for tier in &comparison.tiers {
        let _ = writeln!(
            text,
            "{:<14}{:>8}{:>8}{:>8} ({:>4.1} %)   {}",
            plural(tier.kind),
            tier.cells.len(),
            tier.cells.iter().filter(|cell| cell.differs).count(),
            tier.sparse,
            100.0 * tier.sparse_energy,
            detectable_db(tier).map_or_else(|| "nothing".to_owned(), |level| format!("{level:.2} dB")),
        );
    }
    let beyond = comparison.beyond_noise();
    text.push('\n');
    text.push_str(&listing(&beyond, if list_all { usize::MAX } else { LISTED }));
    text.push_str(&verdict(comparison, &beyond));
    text
}

fn listing(beyond: &[&CellDifference], most: usize) -> String {
    let mut text = String::new();
    if beyond.is_empty() {
        return text;
    }
    text.push_str("   B/A [dB]      95 % interval      time [ms]  where, bands [Hz], source\n");
    for cell in beyond.iter().take(most) {
        let ratio = match (cell.ratio_db, cell.interval_db) {
            (Some(value), Some([low, high])) => format!("{value:>+11.3}   {low:>+7.3} … {high:>+7.3}"),
            _ if cell.incident[0] > 0.0 => format!("{:>31}", "only in A"),
            _ => format!("{:>31}", "only in B"),
        };
        let _ = writeln!(
            text,
            "{ratio}  {:>5.0} … {:>5.0}  {}; {}; \"{}\"",
            1e3 * cell.window[0],
            1e3 * cell.window[1],
            place(&cell.place),
            list(&cell.center_frequencies_hz),
            cell.source
        );
    }
    if beyond.len() > most {
        let _ = writeln!(text, "   … and {} more: --list prints all", beyond.len() - most);
    }
    text.push('\n');
    text
}

fn verdict(comparison: &MapComparison, beyond: &[&CellDifference]) -> String {
    let tested: usize = comparison.tiers.iter().map(|tier| tier.cells.len()).sum();
    if beyond.is_empty() {
        format!("same within noise: none of {tested} cells differs (false alarm in 1 % of comparisons)\n")
    } else {
        format!(
            "different: {} of {tested} cells differ beyond noise (false alarm in 1 % of comparisons), the most \
             significant first\n",
            beyond.len()
        )
    }
}

/// The level that |B/A| has to exceed to be found, in the median cell.
fn detectable_db(tier: &Tier) -> Option<f64> {
    let mut levels: Vec<f64> = tier
        .cells
        .iter()
        .map(|cell| 10.0 * (1.0 + cell.critical / cell.incident[0].max(cell.incident[1])).log10())
        .filter(|level| level.is_finite())
        .collect();
    levels.sort_by(f64::total_cmp);
    levels.get(levels.len() / 2).copied()
}

fn pairing(pairing: MapPairing) -> &'static str {
    match pairing {
        MapPairing::Batches => "same random numbers, compared batch by batch",
        MapPairing::SameSeed => {
            "same seed but different numbering of emissions: treated as independent, small differences may go undetected"
        }
        MapPairing::Independent => "independent runs",
    }
}

fn plural(kind: PlaceKind) -> &'static str {
    match kind {
        PlaceKind::Room => "room",
        PlaceKind::Material => "materials",
        PlaceKind::Surface => "surfaces",
    }
}

fn place(place: &ArrivalPlace) -> String {
    match place {
        ArrivalPlace::Room => "the room".to_owned(),
        ArrivalPlace::Material(name) => format!("all of \"{name}\""),
        ArrivalPlace::Surface { in_a, in_b, material, area } => {
            let number = if in_a == in_b { in_a.to_string() } else { format!("{in_a} (in B {in_b})") };
            format!("surface {number} of \"{material}\", {area:.2} m²")
        }
    }
}
