//! Rooms in a row with partitions between them, drawn in several ways, with the slow simulator of the test kit beside them.

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::{Mesh, MeshTriangle};
use sonel_map::Settings;
use sonel_renderer::{Estimator, RenderSettings};
use sonel_scene::Scene;
use sonel_testkit::row_of_rooms::RowOfRooms;
use sonel_testkit::z_test::{Estimate, Within, agree};

use crate::meshes::{add_box, add_quad};
use crate::{Traced, batch_fluence};

/// Extent of a room [m].
const SIZE: DVec3 = dvec3(4.0, 5.0, 3.0);
const SOURCE: [f64; 3] = [1.1, 2.1, 1.2];
/// Receivers in the rooms, from their lower corners [m].
const RECEIVERS: [[f64; 3]; 3] = [[2.9, 3.4, 1.3], [1.8, 3.1, 1.4], [2.2, 1.9, 1.6]];
const WALL: u32 = 0;
const PARTITION: u32 = 1;

/// How partitions are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drawn {
    /// As sheets.
    Sheets,
    /// As solids of a thickness [m] between the walls of one hull.
    Solids(f64),
    /// As gaps of a width [m] between rooms that are closed shells.
    Shells(f64),
    /// As two faces a distance [m] apart, in a hull whose floor, ceiling and side walls run through between them.
    Faces(f64),
}

impl Drawn {
    fn thickness(self) -> f64 {
        match self {
            Self::Sheets => 0.0,
            Self::Solids(thickness) | Self::Shells(thickness) | Self::Faces(thickness) => thickness,
        }
    }
}

/// The rooms with the source in the first and a receiver in each.
#[must_use]
pub fn scene(row: RowOfRooms, drawn: Drawn) -> Scene {
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave");
    let wall = |name| Material::uniform(name, row.absorption, row.scattering, 1);
    let mut partition = wall("partition");
    partition.transmission = vec![row.transmission];
    let step = SIZE.x + drawn.thickness();
    let (mesh, air_at) = as_read(&mesh(row.rooms, drawn));
    let mut scene = Scene::from_parts(mesh, vec![wall("wall"), partition], bands, 1.2)
        .with_source("source", SOURCE)
        .without_air_attenuation();
    scene.air_at = air_at;
    for (room, [x, y, z]) in RECEIVERS.into_iter().take(row.rooms).enumerate() {
        scene = scene.with_receiver("receiver", [x + room as f64 * step, y, z]);
    }
    scene
}

/// A mesh as the loader of scenes leaves it, where faces of [`PARTITION`] transmit, and where it has air.
fn as_read(mesh: &Mesh) -> (Mesh, Vec<DVec3>) {
    let mut file = String::new();
    let mut write = |line: String| file.extend([line.as_str(), "\n"]);
    mesh.vertices.iter().for_each(|DVec3 { x, y, z }| write(format!("v {x} {y} {z}")));
    for MeshTriangle { corners: [a, b, c], material } in &mesh.triangles {
        write(format!("usemtl {}", ["wall", "partition"][*material as usize]));
        write(format!("f {} {} {}", a + 1, b + 1, c + 1));
    }
    let text = "mesh = \"row.obj\"\nduration_s = 1\n[materials.wall]\nabsorption = 0.2\n[materials.partition]\n\
                absorption = 0.2\ntransmission = 0.1\n[[sources]]\nposition = [1.1, 2.1, 1.2]\n";
    let loaded = sonel_scene::load(text, "row", &mut |_| Ok(file.clone().into_bytes()));
    let Scene { mut mesh, materials, air_at, .. } = loaded.expect("a sound scene").scene;
    for triangle in &mut mesh.triangles {
        let is_partition = materials[triangle.material as usize].name == "partition";
        triangle.material = if is_partition { PARTITION } else { WALL };
    }
    (mesh, air_at)
}

fn mesh(rooms: usize, drawn: Drawn) -> Mesh {
    let thickness = drawn.thickness();
    let step = SIZE.x + thickness;
    if let Drawn::Shells(_) = drawn {
        let mut mesh = Mesh::default();
        for room in 0..rooms {
            let kind = |is_partition| if is_partition { PARTITION } else { WALL };
            let ends = [kind(room > 0), kind(room + 1 < rooms)];
            let shell = Mesh::shoebox(SIZE.to_array(), [ends[0], ends[1], WALL, WALL, WALL, WALL]);
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(shell.vertices.iter().map(|it| *it + dvec3(room as f64 * step, 0.0, 0.0)));
            mesh.triangles.extend(shell.triangles.iter().map(|triangle| MeshTriangle {
                corners: triangle.corners.map(|corner| corner + first),
                ..*triangle
            }));
        }
        return mesh;
    }
    let mut mesh = Mesh::shoebox([rooms as f64 * step - thickness, SIZE.y, SIZE.z], [WALL; 6]);
    for room in 1..rooms {
        let x = room as f64 * step - thickness;
        let corner = |x: f64, y: f64, z: f64| dvec3(x, y * SIZE.y, z * SIZE.z);
        let faces: &[f64] = match drawn {
            Drawn::Sheets => &[x],
            Drawn::Faces(thickness) => &[x, x + thickness],
            _ => &[],
        };
        for &x in faces {
            let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
            add_quad(&mut mesh, PARTITION, corners.map(|[y, z]| corner(x, y, z)));
        }
        if faces.is_empty() {
            add_box(&mut mesh, PARTITION, corner(x, 0.0, 0.0), corner(x + thickness, 1.0, 1.0));
        }
    }
    mesh
}

/// Fluences at the receivers by the slow simulator.
#[must_use]
pub fn fluences(row: RowOfRooms, rays: usize) -> Vec<Estimate> {
    let receivers: Vec<[f64; 3]> = (0..row.rooms)
        .map(|room| [RECEIVERS[room][0] + room as f64 * SIZE.x, RECEIVERS[room][1], RECEIVERS[room][2]])
        .collect();
    row.fluences(SOURCE, &receivers, 0.5, rays)
}

/// A row of `rooms`.
#[must_use]
pub fn row(rooms: usize, scattering: f64) -> RowOfRooms {
    RowOfRooms { rooms, size: SIZE.to_array(), absorption: 0.2, scattering, transmission: 0.1 }
}

/// Fluences at the receivers as rendered.
///
/// # Panics
/// Where packets lose energy.
#[must_use]
pub fn rendered(row: RowOfRooms, drawn: Drawn, estimator: Estimator, emissions: u64) -> Vec<Estimate> {
    let settings = Settings { emissions, ..Settings::default() };
    let traced = Traced::with(&["transmission"], scene(row, drawn), settings);
    assert!(traced.geometry.is_watertight() && traced.ledger.worst_residual() < 1e-9);
    let rendering = traced.render(RenderSettings { estimator, ..RenderSettings::default() });
    let of = |receiver| batch_fluence(&rendering, receiver, 0);
    (0..row.rooms).map(of).map(|(value, sigma)| Estimate { value, sigma }).collect()
}

/// Checks that all rooms get what the slow simulator counts, within 4 σ each, and that a factor `loss` at each partition would show; how far
/// they are off [dB].
///
/// # Panics
/// Where they do not.
pub fn check(name: &str, loss: f64, rendered: &[Estimate], counted: &[Estimate]) -> Vec<f64> {
    let decibels =
        |(rendered, counted): (&Estimate, &Estimate)| 10.0 * (rendered.value / counted.value).log10();
    let off: Vec<f64> = rendered.iter().zip(counted).map(decibels).collect();
    let differs = |loss: f64| {
        (0_i32..).zip(rendered).zip(counted).find_map(|((room, rendered), counted)| {
            let expected = Estimate { value: counted.value * loss.powi(room), ..*counted };
            let within = Within { sigmas: 4.0, maximal_sigma: 0.035 * counted.value };
            agree(*rendered, expected, within).err().map(|off| format!("room {room}: {off}"))
        })
    };
    assert_eq!(differs(1.0), None, "{name}: off by {off:.3?} dB");
    assert!(differs(loss).is_some(), "{name}: a loss within the thickness is found");
    off
}
