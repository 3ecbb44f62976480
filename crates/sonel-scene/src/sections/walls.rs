//! `mesh`, `mesh_unit`, `mesh_weld`, `mesh_up` or `shoebox`: the walls.

use std::collections::HashSet;

use glam::DVec3;
use sonel_acoustics::Material;
use sonel_geometry::Mesh;

use crate::document::{Entry, Table, quoted_key};
use crate::formats;
use crate::mesh_file::{self, FARTHEST, MeshOfFile, Stated};
use crate::polygon_mesh::PolygonMesh;
use crate::report::Report;
use crate::suggest::suggest;

/// Opens a mesh by the path in the scene file, relative to it.
pub(crate) use crate::formats::Open as OpenMesh;

/// Default distance up to which cracks of a mesh are closed [m]. Chosen, not measured: more than drawings are rounded by, less than a detail;
/// doubled, details of 2 mm are joined.
const DEFAULT_WELD: f64 = 1e-3;
/// Largest distance that may be stated [m]. Chosen: whatever is farther apart is a design, not a drawing error.
const LARGEST_WELD: f64 = 0.1;

/// Names of a shoebox's walls; a material of that name covers that wall.
const SHOEBOX_WALLS: [&str; 6] = ["x0", "x1", "y0", "y1", "z0", "z1"];
/// The material of a shoebox's other walls.
const SHOEBOX_MATERIAL: &str = "walls";

/// Units of a mesh file and their length [m].
pub(crate) const UNITS: [(&str, f64); 6] =
    [("m", 1.0), ("mm", 0.001), ("cm", 0.01), ("dm", 0.1), ("in", 0.0254), ("ft", 0.3048)];

/// The walls, the digest of what they were read from and where the file names them.
pub(crate) struct Walls {
    pub(crate) mesh: Mesh,
    pub(crate) digest: [u8; 32],
    pub(crate) at: usize,
    pub(crate) path: &'static str,
    /// Length of the unit of a mesh file [m]; none for a shoebox.
    pub(crate) unit: Option<f64>,
    /// Distance up to which cracks are closed [m].
    pub(crate) weld: f64,
    /// Names of the mesh that are no material of the scene; triangles index them behind the materials.
    pub(crate) unknown: Vec<String>,
}

impl Walls {
    /// Whether they are those of a shoebox.
    pub(crate) fn is_shoebox(&self) -> bool {
        self.unit.is_none()
    }

    /// Notes materials that cover nothing; in a shoebox one whose name is not that of a side is a mistake.
    pub(crate) fn note_unused(&self, materials: &[Material], up: DVec3, report: &Report) {
        let used: HashSet<u32> = self.mesh.triangles.iter().map(|triangle| triangle.material).collect();
        for (_, Material { name, .. }) in (0_u32..).zip(materials).filter(|(index, _)| !used.contains(index))
        {
            let table = format!("materials.{}", quoted_key(name));
            if self.is_shoebox() && !is_side(name) {
                let [floor, ceiling] = if up == DVec3::Y { ["y0", "y1"] } else { ["z0", "z1"] };
                report.warn(format!(
                    "{table}: covers no side of the shoebox; its sides are x0, x1, y0, y1, z0, z1 (floor {floor}, ceiling {ceiling}), \
                     and walls for those without a table: rename this table, or remove it"
                ));
            } else {
                report.note(format!("{table}: the material is not used"));
            }
        }
    }
}

/// Whether a material of this name covers sides of a shoebox.
pub(crate) fn is_side(name: &str) -> bool {
    name == SHOEBOX_MATERIAL || SHOEBOX_WALLS.contains(&name)
}

/// Upward direction in the axes of the scene.
pub(crate) fn read_up(document: &Table<'_>) -> DVec3 {
    let Some(entry) = document.get("mesh_up") else { return DVec3::Z };
    match entry.text() {
        Some("y") => DVec3::Y,
        Some("z") | None => DVec3::Z,
        Some(unknown) => {
            entry.problem(&format!("unknown axis `{unknown}`; known: z, y"));
            DVec3::Z
        }
    }
}

/// Reads the walls; `None` when they have problems.
pub(crate) fn read(
    document: &Table<'_>,
    materials: &[Material],
    open_mesh: OpenMesh<'_>,
    made: Option<&PolygonMesh>,
) -> Option<Walls> {
    let unit = read_unit(document);
    let weld = read_weld(document);
    match (document.get("mesh"), document.get("shoebox")) {
        (None, None) => {
            document.report.problem(0, "mesh: missing; name a mesh file, or give shoebox = [x, y, z]");
            None
        }
        (Some(_), Some(shoebox)) => {
            shoebox.problem("given together with mesh; keep one of the two");
            None
        }
        (Some(mesh), None) => {
            let stated = unit.map(|unit| Stated { unit, up: document.get("mesh_up").is_some() });
            read_mesh(&mesh, stated.zip(weld), materials, open_mesh, made)
        }
        (None, Some(shoebox)) => {
            if let Some(entry) = document.get("mesh_unit") {
                entry.problem("a shoebox is in metres; remove this key");
            }
            if let Some(entry) = document.get("mesh_weld") {
                entry.problem("a shoebox has no cracks; remove this key");
            }
            read_shoebox(&shoebox, materials)
        }
    }
}

/// The length of the unit, if it is stated [m]; `None` when it cannot be read.
fn read_unit(document: &Table<'_>) -> Option<Option<f64>> {
    let Some(entry) = document.get("mesh_unit") else { return Some(None) };
    let name = entry.text()?;
    let found = UNITS.iter().find(|(unit, _)| *unit == name).map(|(_, length)| *length);
    if found.is_none() {
        let advice = suggest(name, UNITS.iter().map(|(unit, _)| *unit));
        entry.problem(&format!("unknown unit `{name}`; {advice}"));
    }
    found.map(Some)
}

fn read_weld(document: &Table<'_>) -> Option<f64> {
    let Some(entry) = document.get("mesh_weld") else { return Some(DEFAULT_WELD) };
    let weld = entry.number()?.value;
    let is_allowed = (0.0..=LARGEST_WELD).contains(&weld);
    if !is_allowed {
        let message = format!("{weld} m is outside 0 … {LARGEST_WELD} m; 0 closes no cracks");
        entry.problem(&message);
    }
    is_allowed.then_some(weld)
}

/// Reads the mesh; `stated` is what the scene file says of it, and the width up to which cracks are closed [m].
fn read_mesh(
    entry: &Entry<'_>,
    stated: Option<(Stated, f64)>,
    materials: &[Material],
    open_mesh: OpenMesh<'_>,
    made: Option<&PolygonMesh>,
) -> Option<Walls> {
    let path = entry.filled_text()?;
    let polygons = match made {
        Some(made) => made.polygons(),
        None => formats::read(path, &entry.file(path, open_mesh)?, open_mesh),
    };
    let unknown = Stated { unit: None, up: true };
    let read_as = stated.as_ref().map_or(&unknown, |(stated, _)| stated);
    let MeshOfFile { mesh, unknown, unit } =
        mesh_file::read(polygons, path, read_as, materials, entry.report)?;
    // Read for its own problems; in an unknown unit nothing can be said about positions in it.
    let (_, weld) = stated?;
    let digest = digest(&mesh);
    Some(Walls { mesh, digest, at: entry.at, path: "mesh", unit: Some(unit), weld, unknown })
}

/// Digest of the mesh as it was read, in whatever format.
fn digest(mesh: &Mesh) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    for number in mesh.vertices.iter().flat_map(|vertex| vertex.to_array()) {
        hasher.update(&number.to_le_bytes());
    }
    for triangle in &mesh.triangles {
        for index in triangle.corners.into_iter().chain([triangle.material]) {
            hasher.update(&index.to_le_bytes());
        }
    }
    hasher.finalize().into()
}

fn read_shoebox(entry: &Entry<'_>, materials: &[Material]) -> Option<Walls> {
    let size = entry.vector()?;
    let is_size = |length: f64| length > 0.0 && length <= FARTHEST;
    if !size.to_array().into_iter().all(is_size) {
        return entry
            .refused(&format!("{size} is not a size; give three lengths above 0 m, at most {FARTHEST:e} m"));
    }
    let walls = shoebox_materials(entry, materials)?;
    let mesh = Mesh::shoebox(size.to_array(), walls);
    Some(Walls {
        mesh,
        digest: *blake3::hash(&[]).as_bytes(),
        at: entry.at,
        path: "shoebox",
        unit: None,
        weld: 0.0,
        unknown: Vec::new(),
    })
}

/// The material of each wall: that of its own name, else that of all walls.
fn shoebox_materials(entry: &Entry<'_>, materials: &[Material]) -> Option<[u32; 6]> {
    let named = |name: &str| (0u32..).zip(materials).find(|(_, material)| material.name == name);
    let of_wall = |wall: &str| named(wall).or_else(|| named(SHOEBOX_MATERIAL)).map(|(index, _)| index);
    let found = SHOEBOX_WALLS.map(of_wall);
    if found.contains(&None) {
        let names: Vec<&str> = materials.iter().map(|material| material.name.as_str()).collect();
        let message = format!(
            "its walls need a table [materials.walls], or one for each of x0, x1, y0, y1, z0, z1; found: {}",
            names.join(", ")
        );
        return entry.refused(&message);
    }
    Some(found.map(Option::unwrap_or_default))
}
