//! Rooms of boxes: a rectilinear grid, its quads, and what is expected of them.

pub(crate) mod figures;
pub(crate) mod grid;
pub(crate) mod mesh;

use anyhow::{Context, Result};
use sonel_scene::Scene;
use xtask::workspace;

/// The scene of a file named from the root.
pub(crate) fn scene(path: &str) -> Result<Scene> {
    let folder = workspace::root().join(path);
    let folder = folder.parent().context("a scene file lies in a folder")?;
    let mut open = |mesh: &str| std::fs::read(folder.join(mesh));
    Ok(sonel_scene::load(&workspace::read(path)?, path, &mut open)?.scene)
}
