//! Mesh files: OBJ, glTF, STL, PLY and DXF become polygons over vertices, each under a name.
//!
//! The format is told by the first bytes where they are a signature, else by the ending of the name, else the file is OBJ.
//! Names are what the scene file calls materials: `usemtl`, a glTF material, an STL solid, a PLY colour, a DXF layer.

mod collector;
mod dxf;
mod gltf;
mod ply;
mod stl;

use std::io;

use glam::DMat3;

use crate::obj::{self, Polygons};
use crate::problem::LineProblem;

pub(crate) use collector::Collector;

/// Opens a file by its path relative to the scene file. If a mesh names the file and not the scene, `/./` stands behind the folder of the mesh, which
/// no link may lead out of.
pub(crate) type Open<'a> = &'a mut dyn FnMut(&str) -> io::Result<Vec<u8>>;

/// The formats that are read, in words.
pub const MESH_FORMATS: &str = "OBJ, glTF, STL, PLY or DXF";

/// Formats of programs that can export one of ours.
const FOREIGN: [&str; 11] = ["skp", "3dm", "rvt", "ifc", "blend", "fbx", "dae", "3ds", "dwg", "step", "stp"];

/// Whether a file is a mesh by the ending of its name.
#[must_use]
pub fn is_mesh(path: &str) -> bool {
    ["obj", "glb", "gltf", "ply", "stl", "dxf"].iter().chain(&FOREIGN).any(|known| *known == ending(path))
}

fn ending(path: &str) -> String {
    path.rsplit_once('.').map_or(String::new(), |(_, ending)| ending.to_lowercase())
}

/// Reads the file at `path`.
///
/// # Errors
/// Every problem of the file.
pub(crate) fn read(path: &str, bytes: &[u8], open: Open<'_>) -> Result<Polygons, Vec<LineProblem>> {
    let ending = ending(path);
    let begin = &bytes[..bytes.len().min(512)];
    if begin.starts_with(b"glTF") || ["glb", "gltf"].contains(&ending.as_str()) {
        gltf::read(path, bytes, open)
    } else if begin.starts_with(b"ply\n") || begin.starts_with(b"ply\r") || ending == "ply" {
        ply::read(bytes)
    } else if ending == "dxf" {
        dxf::read(bytes)
    } else if ending == "stl" {
        stl::read(bytes)
    } else if FOREIGN.contains(&ending.as_str()) {
        let message = format!(".{ending} files are not read: export {MESH_FORMATS}");
        Err(vec![LineProblem::new(0, message)])
    } else {
        obj::read(bytes)
    }
}

/// Uncertainty of a rotation of 32-bit numbers [1]: two units in the last place of 1.
const ROTATION_ROUNDING: f64 = 2.4e-7;

/// A rotation by right angles without its rounding, so that it keeps the coordinates of a room; any other as it is.
fn right_angled(rotation: DMat3) -> DMat3 {
    let rounded = DMat3::from_cols_array(&rotation.to_cols_array().map(f64::round));
    if rotation.abs_diff_eq(rounded, ROTATION_ROUNDING) { rounded } else { rotation }
}

/// The little-endian 32-bit float at a place of `bytes`.
fn float(bytes: &[u8], at: usize) -> f64 {
    f64::from(f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]))
}

/// A colour as a name.
fn color_name([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}
