//! Rays aimed at the edges and vertices of the shipped rooms: none may pass, of 200 000 in each room for every change, of a
//! million before a release.
//!
//! The rooms that only exist to be hard (tessellated, perturbed, moved far away) are tested beside the ray casting.

use glam::DVec3;
use sonel_geometry::{Departure, Geometry, Side};
use sonel_testkit::uniform::Uniform;
use sonel_tests::shipped;

/// Rays in each room.
const RAYS: u32 = crate::WATERTIGHT_RAYS;

/// A shipped room and points in its air.
fn room(name: &str) -> (Geometry, Vec<DVec3>) {
    let scene = shipped(name);
    let sources = scene.sources.iter().map(|source| source.position);
    let receivers = scene.receivers.iter().map(|receiver| receiver.position);
    (scene.geometry().expect("a sound mesh"), sources.chain(receivers).collect())
}

/// How many of [`RAYS`] rays leave the air: meet nothing, or the solid side of a closed shell. A ray at the rim of a seat may
/// well pass it, but only into the air behind.
fn misses(geometry: &Geometry, inside: &[DVec3]) -> u32 {
    let mut random = Uniform::new(5);
    let mesh = geometry.mesh();
    let mut misses = 0;
    for ray in 0..RAYS {
        let from = geometry.to_local(inside[random.below(inside.len())]);
        let corners = mesh.triangles[random.below(mesh.triangles.len())].corners;
        let (a, b) = (mesh.vertices[corners[0] as usize], mesh.vertices[corners[1] as usize]);
        // Every fourth ray goes at a vertex, the others at a point of an edge.
        let along = if ray % 4 == 0 { 0.0 } else { random.next_f64() };
        let target = geometry.to_local(a.lerp(b, along));
        let hit = geometry.closest_hit(Departure::free(from), (target - from).normalize());
        let in_air = hit.is_some_and(|hit| hit.side == Side::Front || !geometry.surface(hit.surface).closed);
        misses += u32::from(!in_air);
    }
    misses
}

#[test]
fn no_ray_slips_through_an_edge_of_a_shipped_room() {
    for name in ["seed-room", "shoebox", "hall"] {
        let (geometry, inside) = room(name);
        assert_eq!(misses(&geometry, &inside), 0, "{name}");
    }
}
