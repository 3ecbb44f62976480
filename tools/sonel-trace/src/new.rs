//! `sonel-trace new`: a first scene file for a mesh or a rectangular room.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use clap::builder::PossibleValuesParser;
use sonel::scenes::{Draft, DraftOptions, MESH_FORMATS, Purpose, SceneErrors, shell_word};
use sonel_console::count::numbers;
use sonel_console::output::{Kind, Output};
use sonel_console::progress::Progress;
use sonel_console::{Common, Outcome, input, spelled};

/// Write a commented scene file for a mesh or a rectangular room: materials to choose from, a source, receivers
///
/// Unit and upward axis of a mesh are found from its sizes and the names of its materials, and logged. Edit the result, then run
/// `sonel-trace check`.
#[derive(Debug, Clone, Args)]
#[command(
    after_long_help = "Examples:\n  sonel-trace new --shoebox 9,7,3 --purpose classroom -o classroom.toml\n  sonel-trace new hall.glb -o scene.toml"
)]
pub(crate) struct New {
    #[arg(value_name = "MESH", help = format!("The mesh: {MESH_FORMATS}; none with --shoebox"))]
    mesh: Option<PathBuf>,
    /// Inner lengths of a rectangular room [m].
    ///
    /// Along x, y and upwards z, instead of a mesh.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_lengths, conflicts_with_all = ["mesh", "unit", "up"], allow_hyphen_values = true)]
    shoebox: Option<[f64; 3]>,
    /// Use of the room.
    ///
    /// Its target reverberation time is stated, with the standard. A shoebox then has the furniture, ceiling and windows that are
    /// usual for it.
    #[arg(long, value_parser = PossibleValuesParser::new(Purpose::ALL.map(Purpose::name)))]
    purpose: Option<String>,
    /// Unit of the mesh [default: of the file, else by size].
    #[arg(long, value_parser = ["m", "dm", "cm", "mm", "in", "ft"])]
    unit: Option<String>,
    /// Upward axis of the mesh [default: of the file, else by floors].
    #[arg(long, value_name = "AXIS", value_parser = ["z", "y"])]
    up: Option<String>,
    /// Keep only this room of the mesh [default: all].
    ///
    /// Rooms are numbered in the log; 1 is the largest. Source and receiver are in the largest.
    #[arg(long, value_name = "N", conflicts_with = "shoebox")]
    room: Option<usize>,
    /// Scene file to write.
    ///
    /// An existing file is not replaced.
    #[arg(short, long, value_name = "SCENE.toml")]
    output: PathBuf,
    #[command(flatten)]
    pub(crate) common: Common,
}

/// Reads three lengths [m]; the scene file says which are possible.
fn parse_lengths(text: &str) -> anyhow::Result<[f64; 3]> {
    numbers(text, ',').context("give three lengths in metres, such as 9,7,3")
}

/// Writes the scene file.
///
/// # Errors
/// When the mesh cannot be read, its unit is not clear, it has no free place for a source, or the output cannot be written.
pub(crate) fn run(new: &New, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let output = Output::create(&new.output, Kind::SCENE, &[])?;
    let options = DraftOptions {
        purpose: new.purpose.as_deref().and_then(|purpose| purpose.parse().ok()),
        unit: new.unit.as_deref(),
        up: new.up.as_deref(),
        room: new.room,
    };
    let draft = match (&new.shoebox, &new.mesh) {
        (Some(lengths), _) => sonel::scenes::draft_shoebox(*lengths, &options),
        (None, Some(mesh)) => of_mesh(new, mesh, &options)?,
        (None, None) => bail!("give a mesh, or --shoebox X,Y,Z"),
    };
    let Draft { text, warnings, notes } = draft.map_err(|errors| spelled(errors.into()))?;
    for note in notes {
        writeln!(log, "{note}")?;
    }
    for warning in warnings {
        writeln!(log, "warning: {warning}")?;
    }
    output.write(|out| out.write_all(text.as_bytes()))?;
    let output = new.output.display().to_string();
    writeln!(log, "wrote {output}: edit it, then run sonel-trace check {}", shell_word(&output))?;
    Ok(Outcome::Done)
}

fn of_mesh(new: &New, mesh: &Path, options: &DraftOptions<'_>) -> anyhow::Result<Result<Draft, SceneErrors>> {
    let path = beside(mesh, &new.output)?;
    let name = mesh.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let folder = new.output.parent().unwrap_or(Path::new("")).to_owned();
    let _progress = Progress::wait("reading", new.common.quiet);
    Ok(sonel::scenes::draft(&path, &name, options, &mut |path| input::read_in(&folder, path)))
}

/// The path of the mesh as the scene file names it: relative to its folder where the mesh lies in it, else absolute.
fn beside(mesh: &Path, scene: &Path) -> anyhow::Result<String> {
    let whole = |path: &Path| path.canonicalize().with_context(|| format!("cannot read {}", path.display()));
    let folder = match scene.parent() {
        Some(folder) if folder != Path::new("") => whole(folder)?,
        _ => whole(Path::new("."))?,
    };
    let mesh = whole(mesh)?;
    let path = mesh.strip_prefix(&folder).unwrap_or(&mesh);
    match path.to_str() {
        Some(path) => Ok(path.replace('\\', "/")),
        None => bail!("{} is not a UTF-8 name: rename the mesh", path.display()),
    }
}
