//! Rooms that both models can do: boxes with and without obstacles, rooms of all sizes, chosen and drawn, and the shipped hall.

mod random;
mod sizes;

use std::fmt::Write;
use std::path::Path;

use anyhow::{Result, anyhow};
use sonel_scene::Scene;
use xtask::workspace;

const FOLDER: &str = "target/waves";

/// A room and how much work it is worth.
pub(super) struct Room {
    /// In options, file names and the table.
    pub name: String,
    /// Octaves compared [Hz].
    pub bands: &'static [f64],
    /// Packets per source.
    pub packets: &'static str,
    toml: String,
    obj: String,
}

/// Octaves [Hz].
pub(super) const BANDS: &[f64] = &[63.0, 125.0, 250.0];

/// All rooms of the table.
pub(super) fn all() -> Result<Vec<Room>> {
    let hall = Room {
        name: "hall".to_owned(),
        bands: BANDS,
        packets: "30k",
        toml: workspace::read("scenes/hall/scene.toml")?,
        obj: workspace::read("scenes/hall/hall.obj")?,
    };
    let boxes = [
        ("empty", Mesh::room()),
        // Two screens and a balcony.
        ("screens", screens()),
        // 12 boxes of 1 m and six hung panels.
        ("boxes", boxes()),
        // 18 rows of seats.
        ("rows", rows()),
        // Two rooms and a door of 1 m or 4 m.
        ("door-1", two_rooms(1.0)),
        ("door-4", two_rooms(4.0)),
    ];
    let boxes = boxes.map(|(name, mesh)| Room {
        name: name.to_owned(),
        bands: BANDS,
        packets: "30k",
        toml: PLAIN.to_owned(),
        obj: mesh.text,
    });
    Ok(boxes.into_iter().chain([hall]).chain(sizes::all()?).chain(random::all()?).collect())
}

/// 24 × 16 × 10 m, bare but for the floor.
const PLAIN: &str = r#"mesh = "hall.obj"
duration_s = 5.5

[bands]
center_frequencies_hz = [63, 125, 250]

[air]
attenuation = false

[materials.walls]
absorption = 0.05
scattering = 0.1

[materials.floor]
absorption = 0.4
scattering = 0.1

[[sources]]
position = [4.1, 6.3, 1.6]

[[receivers]]
position = [10.3, 9.1, 1.9]

[[receivers]]
position = [15.2, 4.3, 2.1]

[[receivers]]
position = [20.1, 11.7, 2.3]

[[receivers]]
position = [13.4, 12.9, 5.2]
"#;

impl Room {
    /// Whether it is one of the boxes of 24 × 16 × 10 m.
    pub(super) fn is_box(&self) -> bool {
        self.toml == PLAIN
    }

    /// Writes scene and mesh below target; the name of the scene file.
    pub(super) fn write(&self, variant: &str, is_locally_reacting: bool) -> Result<String> {
        let folder = format!("{FOLDER}/{}", self.name);
        let mut toml = self.toml.clone();
        if is_locally_reacting {
            let law = |line: &str| {
                let is_material = line.starts_with("[materials.");
                if is_material {
                    format!("{line}\nabsorption_law = \"locally-reacting\"\n")
                } else {
                    format!("{line}\n")
                }
            };
            toml = toml.lines().map(law).collect();
        }
        let name = format!("{folder}/{variant}.toml");
        workspace::write(&name, toml)?;
        workspace::write(&format!("{folder}/hall.obj"), &self.obj)?;
        Ok(name)
    }

    /// The compiled scene.
    pub(super) fn scene(&self) -> Result<Scene> {
        let file = self.write("packets", false)?;
        let folder = workspace::root().join(Path::new(&file).parent().expect("a file in a folder"));
        let loaded = sonel_scene::load(&self.toml, &file, &mut |mesh| std::fs::read(folder.join(mesh)));
        Ok(loaded.map_err(|problems| anyhow!("{problems}"))?.scene)
    }
}

#[derive(Default)]
struct Mesh {
    text: String,
    vertices: usize,
}

impl Mesh {
    fn room() -> Self {
        let mut mesh = Self::default();
        mesh.add_box([0.0; 3], [24.0, 16.0, 10.0], ["floor", "walls"]);
        mesh
    }

    /// Six faces, the lowest of the first material, which is left out where it is empty.
    fn add_box(&mut self, from: [f64; 3], to: [f64; 3], [bottom, others]: [&str; 2]) {
        let [x, y, z] = [0, 1, 2].map(|axis| [from[axis], to[axis]]);
        let corner = |i: usize| [x[i & 1], y[i >> 1 & 1], z[i >> 2]];
        self.add_quad([0, 2, 3, 1].map(corner), bottom);
        for face in [[4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            self.add_quad(face.map(corner), others);
        }
    }

    fn add_quad(&mut self, corners: [[f64; 3]; 4], material: &str) {
        if material.is_empty() {
            return;
        }
        for [x, y, z] in corners {
            writeln!(self.text, "v {x} {y} {z}").expect("text has room");
        }
        let [a, b, c, d] = [1, 2, 3, 4].map(|corner| self.vertices + corner);
        writeln!(self.text, "usemtl {material}\nf {a} {b} {c} {d}").expect("text has room");
        self.vertices += 4;
    }

    /// A sheet at right angles to the axis in which it has no extent.
    fn add_sheet(&mut self, from: [f64; 3], to: [f64; 3]) {
        let axis = (0..3).find(|&axis| from[axis].total_cmp(&to[axis]).is_eq()).expect("a plane");
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let corner = |[along, across]: [bool; 2]| {
            let mut corner = from;
            corner[u] = if along { to[u] } else { from[u] };
            corner[v] = if across { to[v] } else { from[v] };
            corner
        };
        let corners = [[false, false], [true, false], [true, true], [false, true]].map(corner);
        self.add_quad(corners, "walls");
    }
}

fn screens() -> Mesh {
    let mut mesh = Mesh::room();
    mesh.add_sheet([8.0, 3.0, 0.0], [8.0, 13.0, 3.0]);
    mesh.add_sheet([17.0, 0.0, 0.0], [17.0, 9.0, 4.0]);
    mesh.add_sheet([18.0, 0.0, 5.0], [24.0, 16.0, 5.0]);
    mesh
}

fn boxes() -> Mesh {
    let mut mesh = Mesh::room();
    for number in 0..12_u32 {
        let [x, y] = [3.0 + 5.5 * f64::from(number % 4), 1.5 + 5.0 * f64::from(number / 4)];
        let z = 1.0 + 2.0 * f64::from(number % 3);
        mesh.add_box([x, y, z], [x + 1.0, y + 1.0, z + 1.0], ["walls", "walls"]);
    }
    for number in 0..6_u32 {
        let [x, y] = [2.0 + 7.0 * f64::from(number % 3), 2.0 + 7.0 * f64::from(number / 3)];
        let z = 7.0 + 0.5 * f64::from(number % 2);
        mesh.add_sheet([x, y, z], [x + 3.0, y + 2.0, z]);
    }
    mesh
}

fn rows() -> Mesh {
    let mut mesh = Mesh::room();
    for number in 0..18_u32 {
        let x = 6.0 + f64::from(number);
        mesh.add_sheet([x, 1.0, 0.0], [x, 15.0, 1.0]);
    }
    mesh
}

/// A wall across the middle with a door 2.5 m high.
fn two_rooms(door: f64) -> Mesh {
    let mut mesh = Mesh::room();
    let [left, right] = [8.0 - 0.5 * door, 8.0 + 0.5 * door];
    for [from, to] in [[[0.0, 0.0], [left, 2.5]], [[right, 0.0], [16.0, 2.5]], [[0.0, 2.5], [16.0, 10.0]]] {
        mesh.add_sheet([12.0, from[0], from[1]], [12.0, to[0], to[1]]);
    }
    mesh
}
