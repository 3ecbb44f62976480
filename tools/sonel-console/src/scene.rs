//! Scene files and the meshes beside them.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use sonel_geometry::Geometry;
use sonel_scene::{Loaded, Scene, SceneErrors};

use crate::input;
use crate::progress::{Progress, ProgressSink};

/// Runs `read` with the text of the scene file in `path`, its name in messages, and what opens files beside it. Returns the
/// files that were read too.
///
/// # Errors
/// When it cannot be read, and those of `read`.
pub fn with_file<T>(
    path: &Path,
    progress: ProgressSink<'_>,
    read: impl FnOnce(&str, &str, &mut dyn FnMut(&str) -> std::io::Result<Vec<u8>>) -> Result<T, SceneErrors>,
) -> anyhow::Result<(T, Vec<PathBuf>)> {
    let text =
        input::read_to_string(path).with_context(|| format!("cannot read the scene {}", path.display()))?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let mut files = vec![path.to_owned()];
    let mut open = |beside: &str| {
        files.push(folder.join(beside));
        input::read(&folder.join(beside))
    };
    // A mesh of a million triangles takes its time.
    let progress = Progress::wait("reading", progress);
    let result = read(&text, &path.display().to_string(), &mut open);
    progress.end();
    Ok((result?, files))
}

/// The scene in `path`, its walls, and the files that were read. What is noteworthy about both goes to `log`.
///
/// # Errors
/// When it cannot be read; every mistake in it, with file and line.
pub fn load(
    path: &Path,
    progress: ProgressSink<'_>,
    log: &mut dyn Write,
) -> anyhow::Result<(Scene, Geometry, Vec<PathBuf>)> {
    let (loaded, files) =
        with_file(path, progress, |text, label, open| sonel_scene::load(text, label, open))?;
    let (scene, geometry) = tell(loaded, log)?;
    Ok((scene, geometry, files))
}

/// The scene that was `loaded` and its walls; what is noteworthy about it goes to `log`.
///
/// # Errors
/// When `log` cannot be written.
pub fn tell(loaded: Loaded, log: &mut dyn Write) -> std::io::Result<(Scene, Geometry)> {
    let Loaded { scene, geometry, notes, warnings } = loaded;
    for note in notes {
        writeln!(log, "note: {note}")?;
    }
    for warning in warnings {
        writeln!(log, "warning: {warning}")?;
    }
    Ok((scene, geometry))
}
