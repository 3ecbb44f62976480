//! `sonel-trace new`: a first scene file for a mesh.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use sonel_console::output::{Kind, Output};
use sonel_console::progress::{Progress, ProgressSink};
use sonel_console::{Outcome, input};
use sonel_scene::Draft;

use crate::arguments::Common;

/// Write a scene file for a mesh: its materials, the nearest library entries, a source and a receiver
///
/// Edit the result: check materials, unit and positions, then run `sonel-trace check`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:\n  sonel-trace new hall.glb -o scene.toml")]
pub struct New {
    /// The mesh: OBJ, glTF, STL, PLY or DXF.
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// Scene file to write; an existing file is not replaced.
    #[arg(short, long, value_name = "SCENE.toml")]
    output: PathBuf,
    #[command(flatten)]
    pub(crate) common: Common,
}

/// Writes the scene file.
///
/// # Errors
/// When the mesh cannot be read, has no free place for a source, or the output cannot be written.
pub fn run(new: &New, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let output = Output::create(&new.output, Kind::SCENE, std::slice::from_ref(&new.mesh))?;
    let path = beside(&new.mesh, &new.output)?;
    let name = new.mesh.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let folder = new.output.parent().unwrap_or(Path::new("")).to_owned();
    let progress = Progress::wait("reading", ProgressSink::unless(new.common.quiet));
    let draft = sonel_scene::draft(&path, &name, &mut |path| input::read(&folder.join(path)));
    progress.end();
    let Draft { text, warnings } = draft?;
    for warning in warnings {
        writeln!(log, "warning: {warning}")?;
    }
    output.write(|out| out.write_all(text.as_bytes()))?;
    writeln!(log, "wrote {}: edit it, then run sonel-trace check {0}", new.output.display())?;
    Ok(Outcome::Done)
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
