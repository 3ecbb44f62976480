//! A first scene file for a rectangular room.

use std::fmt::Write;

use super::proposal::{CEILINGS, FLOORS, WALLS, choices};
use super::{Draft, DraftOptions, duration, vector};
use crate::document::quoted;
use crate::load::attempt;
use crate::notation::number;
use crate::{SceneErrors, draft::RECEIVER_HEIGHT, draft::SOURCE_HEIGHT};
use glam::DVec3;

/// Where the source is and where receivers are, as shares of length and width: off the middle, where modes and images coincide.
const SOURCE: [f64; 2] = [0.15, 0.4];
const RECEIVERS: [(&str, [f64; 2]); 3] =
    [("front", [0.35, 0.3]), ("middle", [0.6, 0.65]), ("rear", [0.88, 0.42])];
/// Scattering of all walls [1]: furniture and shelves that the shoebox leaves out (docs/formats/scene.md).
const SCATTERING: f64 = 0.3;
/// A line of a floor whose room is judged with people.
const PEOPLE: &str = "# people = 0.4    # per m²: the target is for the occupied room\n";

/// A scene file for a room of `lengths` [m] along x, y and upwards z.
///
/// # Errors
/// When the lengths are no room.
pub fn draft_shoebox(lengths: [f64; 3], options: &DraftOptions<'_>) -> Result<Draft, SceneErrors> {
    let [x, y, z] = lengths;
    let volume = x * y * z;
    let [title, source] = options.purpose.map_or(["Room", "source"], |purpose| purpose.titles);
    let sizes = lengths.map(|length| length.to_string());
    let mut notes = Vec::new();
    let mut head =
        format!("# {title} of {} m, {} m³. Keys: docs/formats/scene.md\n", sizes.join(" × "), number(volume));
    if let Some(purpose) = options.purpose {
        let target = format!("target: {}", purpose.target(volume, z));
        let _ = writeln!(head, "# {target}");
        notes.push(target);
    }
    let keys = format!(
        "name = {}\nshoebox = [{}]    # inner lengths along x, y, z [m]; z is up\n",
        quoted(title),
        sizes.join(", ")
    );
    let mut walls = String::new();
    let [floor, ceiling] = options.purpose.map_or([FLOORS[0], CEILINGS[0]], |purpose| purpose.surfaces);
    let has_windows = options.purpose.is_some();
    let sides = [
        ("z0", "floor", floor, FLOORS),
        ("z1", "ceiling", ceiling, CEILINGS),
        ("y0", "wall with windows, at y = 0", "glass-window", WALLS),
        ("walls", "the other walls; x0, x1, y0, y1 for single ones", WALLS[0], WALLS),
    ];
    for (table, place, chosen, list) in sides.into_iter().filter(|(table, ..)| has_windows || *table != "y0")
    {
        let is_occupied = table == "z0" && options.purpose.is_some_and(super::Purpose::is_occupied);
        let people = if is_occupied { PEOPLE } else { "" };
        let _ = write!(
            walls,
            "\n[materials.{table}]    # {place}\n{}{people}scattering = {SCATTERING}    # chosen: furniture is not drawn\n",
            choices(chosen, list)
        );
    }
    let place = |[along, across]: [f64; 2], height: f64| {
        let point = DVec3::new(along * x, across * y, height.min(0.5 * z));
        vector((point * 100.0).round() / 100.0)
    };
    let mut points =
        format!("\n[[sources]]\nname = \"{source}\"\nposition = {}\n", place(SOURCE, SOURCE_HEIGHT));
    for (name, shares) in RECEIVERS {
        let position = place(shares, RECEIVER_HEIGHT);
        let _ = write!(points, "\n[[receivers]]\nname = \"{name}\"\nposition = {position}\n");
    }
    let rest = format!("{walls}{points}");
    let tried = attempt(
        &format!("{keys}{rest}"),
        "shoebox",
        &mut |_| Err(std::io::ErrorKind::NotFound.into()),
        None,
    )?;
    let Some(geometry) = tried.geometry.filter(|_| tried.problems.is_empty()) else {
        return Err(SceneErrors { problems: tried.problems });
    };
    let text = format!("{head}{keys}{}{rest}", duration(&tried.scene, &geometry));
    Ok(Draft { text, warnings: tried.remarks.warnings, notes })
}
