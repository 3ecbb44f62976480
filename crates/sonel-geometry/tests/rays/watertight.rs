//! Rays from inside a closed mesh aimed at its edges and vertices: every one must meet a wall, and from the inside. (A
//! ray that slips out of a room that is not convex may meet another wall from behind.)

use crate::leaky;
use crate::numbers::Numbers;
use crate::rooms;
use glam::{DVec3, Vec3, dvec3};
use sonel_geometry::{Departure, Geometry, Mesh};

/// In each room; the larger number in release, where `cargo xtask accept` runs it.
const RAYS: usize = if cfg!(debug_assertions) { 60_000 } else { 1_000_000 };

/// Rays from random points in the room, half of them to points on edges, half to vertices.
fn aimed(geometry: &Geometry, count: usize, mut visit: impl FnMut(Vec3, Vec3)) {
    let mesh = geometry.mesh();
    let (low, high) = geometry.bounds();
    let mut numbers = Numbers(5);
    let mut origin = DVec3::ZERO;
    for ray in 0..count {
        if ray % 1000 == 0 {
            // A new place now and then: looking for one inside costs more than the rays.
            origin = std::iter::repeat_with(|| numbers.within(low, high))
                .find(|&point| geometry.contains(point) && geometry.distance_to_nearest_surface(point) > 0.01)
                .expect("the room has an inside");
        }
        let corners = mesh.triangles[numbers.below(mesh.triangles.len())].corners;
        let side = numbers.below(3);
        let [from, to] = [corners[side], corners[(side + 1) % 3]].map(|c| mesh.vertices[c as usize]);
        let share = if ray % 2 == 0 { numbers.unit() } else { 0.0 };
        let (start, target) = (geometry.to_local(origin), geometry.to_local(from + share * (to - from)));
        visit(start, (target - start).normalize());
    }
}

/// Rays that met nothing, or a wall from behind.
fn misses(mesh: Mesh, count: usize, closest: impl Fn(&Geometry, Vec3, Vec3) -> Option<u32>) -> usize {
    let geometry = Geometry::build(mesh).unwrap();
    assert!(geometry.is_closed_room());
    let mut missed = 0;
    aimed(&geometry, count, |origin, direction| {
        let faces = |triangle| {
            let surface = geometry.surface(geometry.triangle_surface(triangle));
            surface.normal.dot(direction.as_dvec3()) < 0.0
        };
        missed += usize::from(!closest(&geometry, origin, direction).is_some_and(faces));
    });
    missed
}

fn ours(geometry: &Geometry, origin: Vec3, direction: Vec3) -> Option<u32> {
    geometry.closest_hit(Departure::free(origin), direction).map(|hit| hit.triangle)
}

#[test]
fn no_ray_slips_through_the_edges_of_a_box() {
    assert_eq!(misses(rooms::shoebox(), RAYS, ours), 0);
    assert_eq!(misses(rooms::turned(rooms::shoebox(), DVec3::ZERO), RAYS, ours), 0);
}

#[test]
fn no_ray_slips_through_the_edges_of_a_tessellated_box() {
    let room = rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 32);
    assert!(room.triangles.len() > 12_000);
    assert_eq!(misses(room.clone(), RAYS, ours), 0);
    assert_eq!(misses(rooms::turned(room, DVec3::ZERO), RAYS, ours), 0);
}

#[test]
fn no_ray_slips_through_the_edges_of_a_boulder() {
    assert_eq!(misses(rooms::boulder(1), RAYS, ours), 0);
    assert_eq!(misses(rooms::boulder(4), RAYS, ours), 0);
}

#[test]
fn no_ray_slips_through_the_edges_of_an_l_shaped_room() {
    assert_eq!(misses(rooms::l_room(), RAYS, ours), 0);
    assert_eq!(misses(rooms::turned(rooms::l_room(), dvec3(1e5, -1e5, 1e5)), RAYS, ours), 0);
}

#[test]
fn no_ray_slips_through_the_t_junctions_of_a_carelessly_drawn_box() {
    assert_eq!(misses(rooms::carelessly_drawn_box(), RAYS, ours), 0);
    assert_eq!(misses(rooms::turned(rooms::carelessly_drawn_box(), DVec3::ZERO), RAYS, ours), 0);
}

#[test]
fn no_shadow_ray_slips_through_the_edges_of_a_convex_room() {
    let fine = rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 8);
    for room in [rooms::shoebox(), rooms::turned(fine, DVec3::ZERO), rooms::sphere(3, 0.0)] {
        let geometry = Geometry::build(room).unwrap();
        let mut lit = 0;
        aimed(&geometry, RAYS / 4, |origin, direction| {
            let outside = origin + 30.0 * direction;
            lit += usize::from(!geometry.is_blocked(Departure::free(origin), outside));
        });
        assert_eq!(lit, 0);
    }
}

#[test]
fn no_ray_from_afar_slips_through_the_seams_of_a_panel() {
    // One wall of a box, aimed at its inner vertices from up to a thousand times its size away.
    let mut panel = rooms::turned(rooms::tessellated_box(DVec3::ONE, 32), dvec3(-0.5, -0.5, -0.5));
    panel.triangles.retain(|triangle| triangle.material == 0);
    let geometry = Geometry::build(panel).unwrap();
    let (mesh, wall) = (geometry.mesh(), &geometry.surfaces()[0]);
    let inner: Vec<DVec3> =
        mesh.vertices.iter().copied().filter(|v| v.distance(wall.centroid) < 0.4).collect();
    let mut numbers = Numbers(21);
    for ray in 0..RAYS {
        let away = 10f64.powf(3.0 * numbers.unit()) * numbers.direction();
        let target = geometry.to_local(inner[numbers.below(inner.len())]);
        let origin = geometry.to_local(geometry.center() + away);
        let direction = (target - origin).normalize();
        // At grazing incidence the rounded direction may pass beside the panel.
        if direction.as_dvec3().dot(wall.normal).abs() > 0.05 {
            assert!(geometry.closest_hit(Departure::free(origin), direction).is_some(), "ray {ray}");
        }
    }
}

#[test]
fn a_leaky_test_is_convicted() {
    for room in [rooms::shoebox(), rooms::turned(rooms::shoebox(), DVec3::ZERO), rooms::boulder(1)] {
        assert!(misses(room, 10_000, leaky::closest) > 10);
    }
}
