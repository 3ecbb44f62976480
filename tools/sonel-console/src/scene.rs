//! Scene files and the meshes beside them.

use std::path::Path;

use anyhow::Context;
use sonel_scene::Loaded;

use crate::input;

/// The scene in `path`, with its mesh and what is noteworthy about both.
///
/// # Errors
/// When it cannot be read; every mistake in it, with file and line.
pub fn load(path: &Path) -> anyhow::Result<Loaded> {
    let text =
        input::read_to_string(path).with_context(|| format!("cannot read the scene {}", path.display()))?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let label = path.display().to_string();
    Ok(sonel_scene::load(&text, &label, &mut |mesh| input::read(&folder.join(mesh)))?)
}
