//! `sonel-trace check`: sizes, statistical times and faults of a scene.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::Args;
use comfy_table::{CellAlignment, Table, presets};
use sonel::check_file;
use sonel::checkup::{notes, report};
use sonel_console::follower::Follower;
use sonel_console::output::{Kind, Output};
use sonel_console::progress::ProgressSink;
use sonel_console::{Log, Outcome};
use sonel_scene::checkup::{Checkup, Covering, Room};
use sonel_scene::folded;

use crate::arguments::Common;

/// Check a scene before tracing; exit code 1 if there are errors, warnings or faults
///
/// Prints sizes, statistical reverberation times, materials by area, and faults of the mesh with their places. A mesh with
/// holes or crossing faces can still be traced.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Examples:\n  sonel-trace check scenes/hall/scene.toml\n  sonel-trace check scene.toml --fix repaired.obj"
)]
pub struct Checked {
    /// The scene file.
    #[arg(value_name = "SCENE.toml")]
    scene: PathBuf,
    /// Write the mesh as it would be traced, in metres, to this OBJ file: corners joined, cracks up to mesh_weld closed,
    /// doubled faces and faces without area left out. Prints the changes to the log.
    #[arg(long, value_name = "MESH.obj")]
    fix: Option<PathBuf>,
    /// Print the same as JSON.
    #[arg(long)]
    json: bool,
    /// Print every default and library entry on a line, instead of all on one.
    #[arg(long)]
    verbose: bool,
    #[command(flatten)]
    pub(crate) common: Common,
}

/// Prints the checkup of a scene.
///
/// # Errors
/// When the scene file cannot be read or is no TOML.
pub fn run(checked: &Checked, out: &mut dyn Write, log: &mut Log<'_>) -> anyhow::Result<Outcome> {
    let progress = ProgressSink::unless(checked.common.quiet);
    let follower = Follower::new(progress, log);
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
    let Checkup { problems, warnings, faults, .. } = &checkup;
    for problem in problems {
        writeln!(out, "error: {problem}")?;
    }
    for warning in warnings {
        writeln!(out, "warning: {warning}")?;
    }
    for fault in faults {
        writeln!(out, "fault: {fault}")?;
    }
    let count = problems.len() + warnings.len() + faults.len();
    match count {
        0 => writeln!(out, "no problems found")?,
        1 => writeln!(out, "1 problem found")?,
        _ => writeln!(out, "{count} problems found")?,
    }
    Ok(outcome)
}

/// Writes the repaired mesh, and the repairs to the log.
fn fix(checkup: &Checkup, path: &Path, files: &[PathBuf], log: &mut dyn Write) -> anyhow::Result<()> {
    let output = Output::create(path, Kind::REPAIRED_MESH, files)?;
    let Some(repaired) = &checkup.repaired else {
        bail!("the mesh cannot be read, see sonel-trace check without --fix")
    };
    let unfit = |name| anyhow!("an OBJ file cannot hold the material name \"{name}\": rename it in the mesh");
    let text = repaired.to_obj().map_err(unfit)?;
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
    format!("{}\n\n{}\n{}", lines.join("\n"), coverings(room), times(room))
}

fn coverings(room: &Room) -> String {
    let mut table = table(["material", "area [m²]", "share [%]", "absorption α"]);
    for Covering { name, area, absorption } in &room.coverings {
        let absorption = match absorption {
            Some(values) => values.iter().map(|value| format!("{value:.2}")).collect::<Vec<_>>().join(" "),
            None => "no table in the scene".to_owned(),
        };
        table.add_row([
            name.clone(),
            format!("{area:.1}"),
            format!("{:.1}", 100.0 * area / room.area),
            absorption,
        ]);
    }
    for column in table.column_iter_mut().skip(1).take(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    text(&table)
}

fn times(room: &Room) -> String {
    if room.times.is_empty() {
        return String::new();
    }
    let mut table = table(["f [Hz]", "mean α", "Sabine [s]", "Eyring [s]"]);
    for times in &room.times {
        table.add_row([
            times.center_hz.to_string(),
            format!("{:.3}", times.mean_absorption),
            format!("{:.2}", times.sabine),
            format!("{:.2}", times.eyring),
        ]);
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Right);
    }
    text(&table) + "\n"
}

fn table(headings: [&str; 4]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(headings);
    table
}

fn text(table: &Table) -> String {
    table.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}
