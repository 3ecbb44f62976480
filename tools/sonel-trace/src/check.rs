//! `sonel-trace check`: sizes, statistical times and faults of a scene.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use sonel::analysis::report::aligned;
use sonel::check_file;
use sonel::checkup::{notes, report};
use sonel::scenes::checkup::{Air, Checkup, Covering, Room, Times};
use sonel::scenes::folded;
use sonel_console::follower::Follower;
use sonel_console::output::{Kind, Output};
use sonel_console::quantity::counted;
use sonel_console::{Common, Log, Outcome};

/// Check a scene before tracing; exit code 1 if there are errors, warnings or faults
///
/// Prints sizes, statistical reverberation times, materials by area, and faults of the mesh with their places. A mesh with
/// holes or crossing faces can still be traced.
#[derive(Debug, Clone, Args)]
#[command(
    after_long_help = "Examples:\n  sonel-trace check scenes/hall/scene.toml\n  sonel-trace check scene.toml --fix repaired.obj"
)]
pub(crate) struct Checked {
    /// The scene file.
    #[arg(value_name = "SCENE.toml")]
    scene: PathBuf,
    /// Repaired mesh to write.
    ///
    /// The mesh as it would be traced, in metres: corners joined, cracks up to mesh_weld closed, doubled faces and faces
    /// without area left out. The changes are logged.
    #[arg(long, value_name = "MESH.obj")]
    fix: Option<PathBuf>,
    /// Print the checkup as JSON.
    #[arg(long)]
    json: bool,
    /// Log each default on a line.
    #[arg(long)]
    verbose: bool,
    #[command(flatten)]
    pub(crate) common: Common,
}

/// Prints the checkup of a scene.
///
/// # Errors
/// When the scene file cannot be read or is no TOML.
pub(crate) fn run(checked: &Checked, out: &mut dyn Write, log: &mut Log<'_>) -> anyhow::Result<Outcome> {
    let follower = Follower::new(checked.common.quiet, log);
    let (checkup, files) = follower.result(check_file(&checked.scene, &follower))?;
    drop(follower);
    if let Some(path) = &checked.fix {
        fix(&checkup, path, &files, log)?;
    }
    let outcome = if checkup.is_clean() { Outcome::Done } else { Outcome::Missed };
    if checked.json {
        writeln!(out, "{}", report(&checkup))?;
        return Ok(outcome);
    }
    if let Some(room) = &checkup.room {
        write!(out, "{}", describe(room))?;
    }
    let defaults = match checked.verbose {
        true => checkup.defaults.clone(),
        false => folded(checkup.defaults.iter().map(String::as_str)).into_iter().collect(),
    };
    for note in defaults.into_iter().chain(notes(&checkup)) {
        writeln!(out, "note: {note}")?;
    }
    let errors: Vec<String> = checkup.problems.iter().map(ToString::to_string).collect();
    let found = [("error", &errors), ("warning", &checkup.warnings), ("fault", &checkup.faults)];
    for (kind, sentences) in found {
        sentences.iter().try_for_each(|sentence| writeln!(out, "{kind}: {sentence}"))?;
    }
    match found.iter().map(|(_, sentences)| sentences.len()).sum() {
        0 => writeln!(out, "no problems found")?,
        count => writeln!(out, "{} found", counted(count, "problem"))?,
    }
    Ok(outcome)
}

/// Writes the repaired mesh, and the repairs to the log.
fn fix(checkup: &Checkup, path: &Path, files: &[PathBuf], log: &mut dyn Write) -> anyhow::Result<()> {
    let output = Output::create(path, Kind::REPAIRED_MESH, files)?;
    let Some(repaired) = &checkup.repaired else {
        bail!("the mesh cannot be read, see sonel-trace check without --fix")
    };
    let text = repaired.to_obj()?;
    output.write(|out| out.write_all(text.as_bytes()))?;
    let repairs = match &checkup.repairs[..] {
        [] if checkup.faults.is_empty() => "no repairs were needed".to_owned(),
        [] => "nothing could be repaired".to_owned(),
        repairs => repairs.join("\n  "),
    };
    writeln!(log, "wrote {}, in metres:\n  {repairs}", path.display())?;
    Ok(())
}

fn describe(room: &Room) -> String {
    let [x, y, z] = room.extents.to_array().map(|length| format!("{length:.3}"));
    let [triangles, surfaces] = room.counts;
    let mut lines = vec![
        format!("extents         {x} × {y} × {z} m, {triangles} triangles in {surfaces} surfaces"),
        room.volume.map_or("volume          none: the mesh is not a closed room".to_owned(), |volume| {
            format!("volume          {volume:.1} m³")
        }),
        format!("surface         {:.1} m²", room.area),
    ];
    lines.extend(room.mean_free_path.map(|path| format!("mean free path  {path:.2} m")));
    lines.extend(
        room.schroeder_frequency
            .map(|hz| format!("Schroeder       {hz:.0} Hz: results below it are not valid")),
    );
    format!("{}\n\n{}{}\n{}", lines.join("\n"), airs(room), coverings(room), times(room))
}

/// Most parts of the air that are listed.
const LISTED: usize = 12;
/// Most materials that are named of each.
const NAMED: usize = 4;

/// The parts of the air, where there are several.
fn airs(room: &Room) -> String {
    if room.airs.len() < 2 {
        return String::new();
    }
    let named = |names: &[String]| match names.len().saturating_sub(NAMED) {
        0 => names.join(", "),
        more => format!("{} and {more} more", names[..NAMED].join(", ")),
    };
    let rows =
        (1..).zip(&room.airs).take(LISTED).map(|(number, Air { volume, place, materials, points })| {
            let place = place.map(|place| place.to_array().map(|x| format!("{x:.2}")).join(", "));
            [
                number.to_string(),
                volume.map_or("no bounds".to_owned(), |volume| format!("{volume:.1}")),
                place.unwrap_or_else(|| "outside".to_owned()),
                named(points),
                named(materials),
            ]
        });
    let table = aligned(["air", "volume [m³]", "at [m]", "sources, receivers", "materials"], rows, 0..2);
    match room.airs.len().saturating_sub(LISTED) {
        0 => table + "\n",
        more => format!("{table}{more} smaller ones\n\n"),
    }
}

fn coverings(room: &Room) -> String {
    let rows = room.coverings.iter().map(|Covering { name, area, absorption }| {
        let absorption = match absorption {
            Some(values) => values.iter().map(|value| format!("{value:.2}")).collect::<Vec<_>>().join(" "),
            None => "no table in the scene".to_owned(),
        };
        [name.clone(), format!("{area:.1}"), format!("{:.1}", 100.0 * area / room.area), absorption]
    });
    aligned(["material", "area [m²]", "share [%]", "absorption α"], rows, 1..3)
}

fn times(room: &Room) -> String {
    if room.times.is_empty() {
        return String::new();
    }
    let rows = room.times.iter().map(|Times { center_hz, mean_absorption, sabine, eyring }| {
        [
            center_hz.to_string(),
            format!("{mean_absorption:.3}"),
            format!("{sabine:.2}"),
            format!("{eyring:.2}"),
        ]
    });
    aligned(["f [Hz]", "mean α", "Sabine [s]", "Eyring [s]"], rows, ..) + "\n"
}
