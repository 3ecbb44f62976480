//! Scene files and the meshes beside them.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use sonel_scene::{Loaded, Scene};

use crate::input;

/// The scene in `path` with its mesh, and the files that were read. What is noteworthy about both goes to `log`.
///
/// # Errors
/// When it cannot be read; every mistake in it, with file and line.
pub fn load(path: &Path, log: &mut dyn Write) -> anyhow::Result<(Scene, Vec<PathBuf>)> {
    let text =
        input::read_to_string(path).with_context(|| format!("cannot read the scene {}", path.display()))?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let label = path.display().to_string();
    let mut files = vec![path.to_owned()];
    let mut read = |mesh: &str| {
        files.push(folder.join(mesh));
        input::read(&folder.join(mesh))
    };
    let Loaded { scene, notes, warnings } = sonel_scene::load(&text, &label, &mut read)?;
    for note in notes {
        writeln!(log, "note: {note}")?;
    }
    for warning in warnings {
        writeln!(log, "warning: {warning}")?;
    }
    Ok((scene, files))
}
