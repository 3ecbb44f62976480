//! Two rooms of 6 × 8 × 3 m that share a partition, and the power balance between them.

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_scene::Scene;

use crate::meshes::{add_box, add_quad};

/// Length, width and height of each room [m].
pub const SIZE: DVec3 = dvec3(6.0, 8.0, 3.0);
/// Speed of sound [m/s].
pub const SPEED: f64 = 343.0;

/// How the partition is drawn.
#[derive(Clone, Copy, PartialEq)]
pub enum Partition {
    /// One sheet.
    Sheet,
    /// A solid slab of this thickness [m], which reaches into floor, ceiling and walls' planes.
    Slab(f64),
    /// None: the two rooms are one.
    None,
}

/// The two rooms: walls of `absorption` on each side, a partition that absorbs as the first room's and transmits `transmission`, one of
/// each per band. The source is in the first room, receivers in the first, the second and the second.
///
/// # Panics
/// Where the lists are not of one length.
#[must_use]
pub fn two_rooms(partition: Partition, absorption: [f64; 2], scattering: f64, transmission: &[f64]) -> Scene {
    let bands = Bands::new(
        (0..transmission.len()).map(|b| 250.0 * f64::powi(2.0, b as i32)).collect(),
        BandWidth::Octave,
    )
    .expect("octave bands");
    let count = bands.count();
    let gap = if let Partition::Slab(thickness) = partition { thickness } else { 0.0 };
    let mut mesh = Mesh::default();
    let far = dvec3(2.0 * SIZE.x + gap, SIZE.y, SIZE.z);
    let half = SIZE.x + 0.5 * gap;
    for (material, [from, to]) in [[0.0, half], [half, far.x]].into_iter().enumerate() {
        let face = |a: [f64; 2], b: [f64; 2]| {
            [dvec3(from, a[0], a[1]), dvec3(to, a[0], a[1]), dvec3(to, b[0], b[1]), dvec3(from, b[0], b[1])]
        };
        let (y, z) = (far.y, far.z);
        for quad in [
            face([0.0, 0.0], [y, 0.0]),
            face([y, 0.0], [y, z]),
            face([y, z], [0.0, z]),
            face([0.0, z], [0.0, 0.0]),
        ] {
            add_quad(&mut mesh, material as u32, quad);
        }
    }
    let across =
        |x: f64| [dvec3(x, 0.0, 0.0), dvec3(x, far.y, 0.0), dvec3(x, far.y, far.z), dvec3(x, 0.0, far.z)];
    add_quad(&mut mesh, 0, across(0.0));
    add_quad(&mut mesh, 1, across(far.x));
    match partition {
        Partition::Sheet => add_quad(&mut mesh, 2, across(SIZE.x)),
        Partition::Slab(_) => {
            add_box(&mut mesh, 2, dvec3(SIZE.x, 0.0, 0.0), dvec3(SIZE.x + gap, far.y, far.z));
        }
        Partition::None => {}
    }
    let mut wall = Material::uniform("partition", absorption[0], scattering, count);
    wall.transmission = transmission.to_vec();
    let [first, second] =
        [0, 1].map(|room| Material::uniform(["first", "second"][room], absorption[room], scattering, count));
    let mut scene = Scene::from_parts(mesh, vec![first, second, wall], bands, 2.0)
        .with_source("source", [1.3, 2.1, 1.2])
        .with_receiver("loud", [4.1, 5.3, 1.4])
        .with_receiver("quiet", [gap + 9.1, 5.3, 1.4])
        .with_receiver("quiet too", [gap + 10.7, 2.2, 1.1])
        .without_air_attenuation();
    scene.speed_of_sound = SPEED;
    scene
}

/// Area of the partition [m²].
#[must_use]
pub fn partition_area() -> f64 {
    SIZE.y * SIZE.z
}

/// Surface of one room [m²].
#[must_use]
pub fn room_surface() -> f64 {
    2.0 * (SIZE.x * SIZE.y + SIZE.y * SIZE.z + SIZE.z * SIZE.x)
}

/// Level difference [dB] of the diffuse fields of two rooms in steady state, 10 lg((A₂ + τS)/(τS)), A₂ without what passes.
#[must_use]
pub fn level_difference(absorption: f64, transmission: f64) -> f64 {
    let passed = transmission * partition_area();
    let area = absorption * room_surface() - passed;
    10.0 * ((area + passed) / passed).log10()
}
