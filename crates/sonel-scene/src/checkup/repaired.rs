//! The mesh of a scene as it is traced: cracks closed, corners joined, doubles and faces without area left out.

use std::fmt::Write;

use sonel_geometry::{Geometry, Mesh};
use thiserror::Error;

/// The first line of such a file.
pub const FIRST_LINE: &str = "# Repaired by sonel-trace check --fix";

/// The name of a material that an OBJ file would end early.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("an OBJ file cannot hold the material name \"{0}\": rename it in the mesh")]
pub struct UnfitName(String);

/// A mesh [m] and the names of its materials.
#[derive(Clone, Debug)]
pub struct Repaired {
    mesh: Mesh,
    names: Vec<String>,
}

impl Repaired {
    pub(super) fn of<'n>(geometry: &Geometry, names: impl Iterator<Item = &'n String>) -> Self {
        Self { mesh: geometry.mesh().clone(), names: names.cloned().collect() }
    }

    /// The mesh as OBJ, in metres and the axes of the scene; coordinates are those of the mesh to the last bit.
    ///
    /// # Errors
    /// A material whose name OBJ cannot hold.
    pub fn to_obj(&self) -> Result<String, UnfitName> {
        let is_unfit =
            |name: &&String| name.contains('#') || name.trim() != name.as_str() || name.ends_with('\\');
        if let Some(name) = self.names.iter().find(is_unfit) {
            return Err(UnfitName(name.clone()));
        }
        let mut text = format!("{FIRST_LINE}\n");
        for vertex in &self.mesh.vertices {
            let _ = writeln!(text, "v {} {} {}", vertex.x, vertex.y, vertex.z);
        }
        let mut current = None;
        for triangle in &self.mesh.triangles {
            if current != Some(triangle.material) {
                current = Some(triangle.material);
                let _ = writeln!(text, "usemtl {}", self.names[triangle.material as usize]);
            }
            let [a, b, c] = triangle.corners.map(|corner| corner + 1);
            let _ = writeln!(text, "f {a} {b} {c}");
        }
        Ok(text)
    }
}
