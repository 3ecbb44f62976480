//! The shipped scene of two rooms coupled through an open door: what its equations need, and each room alone.

use glam::{DVec3, dvec3};
use sonel_acoustics::Material;
use sonel_scene::Scene;

use crate::meshes::add_quad;
use crate::two_rooms::{SIZE, room_surface};

/// Area of the door [m²].
pub const DOOR: f64 = 4.2;
/// Its middle [m].
pub const DOOR_MIDDLE: DVec3 = dvec3(6.0, 4.0, 1.05);

/// Absorption area of the live room's walls [m²].
///
/// # Panics
/// Where the scene is another.
#[must_use]
pub fn live_absorption_area(scene: &Scene) -> f64 {
    let alpha = |name: &str| {
        scene.materials.iter().find(|material| material.name == name).expect("a material of it").absorption[0]
    };
    let partition = SIZE.y * SIZE.z;
    alpha("live") * (room_surface() - partition) + alpha("wall") * (partition - DOOR)
}

/// The scene with a sheet in the door that swallows all sound: each room loses what it does through the open door, and gets nothing back.
#[must_use]
pub fn uncoupled(mut scene: Scene) -> Scene {
    let corner = |y: f64, z: f64| dvec3(SIZE.x, y, z);
    let material = scene.materials.len() as u32;
    scene.materials.push(Material::uniform("black", 1.0, 0.0, scene.bands.count()));
    add_quad(
        &mut scene.mesh,
        material,
        [corner(3.0, 0.0), corner(5.0, 0.0), corner(5.0, 2.1), corner(3.0, 2.1)],
    );
    scene
}
