//! Long walks from wall to wall, through [`Geometry::leave`] and the rounded position alone: nobody gets out.

use crate::numbers::Numbers;
use crate::rooms;
use glam::{DVec3, Vec3, dvec3};
use sonel_geometry::{Departure, Geometry, Hit, Mesh};

/// In each room and gait; the larger number in release, where `cargo xtask accept` runs it.
const SEGMENTS: usize = if cfg!(debug_assertions) { 200_000 } else { 1_000_000 };

/// How a walker goes on.
#[derive(Clone, Copy)]
enum Gait {
    Mirror,
    Lambert,
}

/// Walkers that met nothing or were found behind a wall, of those that start near random edges of the room.
fn lost(mesh: Mesh, gait: Gait, leave: impl Fn(&Geometry, &Hit) -> Departure) -> usize {
    let geometry = Geometry::build(mesh).unwrap();
    assert!(geometry.is_closed_room());
    let mut numbers = Numbers(9);
    let mut lost = 0;
    for _ in 0..SEGMENTS / 1000 {
        lost += usize::from(!survives(&geometry, gait, &mut numbers, &leave, 1000));
    }
    lost
}

fn survives(
    geometry: &Geometry,
    gait: Gait,
    numbers: &mut Numbers,
    leave: impl Fn(&Geometry, &Hit) -> Departure,
    segments: usize,
) -> bool {
    let (low, high) = geometry.bounds();
    let start = std::iter::repeat_with(|| numbers.within(low, high))
        .find(|&point| geometry.contains(point) && geometry.distance_to_nearest_surface(point) > 1e-3)
        .expect("the room has an inside");
    // The first step goes for an edge, where walls crowd the walker.
    let mesh = geometry.mesh();
    let corners = mesh.triangles[numbers.below(mesh.triangles.len())].corners;
    let [from, to] = [corners[0], corners[1]].map(|corner| mesh.vertices[corner as usize]);
    let edge = from + numbers.unit() * (to - from) + 1e-4 * numbers.direction();
    let mut direction = (edge - start).normalize().as_vec3();
    let mut at = Departure::free(geometry.to_local(start));
    for _ in 0..segments {
        let Some(hit) = geometry.closest_hit(at, direction) else { return false };
        let surface = geometry.surface(hit.surface);
        if surface.closed && hit.side == sonel_geometry::Side::Back {
            return false;
        }
        let normal = hit.side.sign() * surface.normal;
        direction = match gait {
            Gait::Mirror => mirrored(direction, normal),
            Gait::Lambert => numbers.lambert(normal),
        };
        at = leave(geometry, &hit);
    }
    geometry.contains(geometry.to_world(at.origin))
}

fn mirrored(direction: Vec3, normal: DVec3) -> Vec3 {
    let direction = direction.as_dvec3();
    (direction - 2.0 * direction.dot(normal) * normal).normalize().as_vec3()
}

fn by_the_door(geometry: &Geometry, hit: &Hit) -> Departure {
    geometry.leave(hit.position, hit.surface, hit.side)
}

fn nobody_is_lost(mesh: impl Fn() -> Mesh) {
    for gait in [Gait::Mirror, Gait::Lambert] {
        assert_eq!(lost(mesh(), gait, by_the_door), 0);
    }
}

#[test]
fn in_a_box() {
    nobody_is_lost(rooms::shoebox);
}

#[test]
fn in_a_turned_box() {
    nobody_is_lost(|| rooms::turned(rooms::shoebox(), DVec3::ZERO));
}

#[test]
fn in_a_tessellated_box() {
    nobody_is_lost(|| rooms::turned(rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 8), DVec3::ZERO));
}

#[test]
fn in_an_l_shaped_room() {
    nobody_is_lost(rooms::l_room);
    nobody_is_lost(|| rooms::turned(rooms::l_room(), DVec3::ZERO));
}

#[test]
fn around_a_screen_on_the_floor() {
    nobody_is_lost(rooms::screened_room);
    nobody_is_lost(|| rooms::turned(rooms::screened_room(), DVec3::ZERO));
}

#[test]
fn far_from_the_origin() {
    nobody_is_lost(|| rooms::turned(rooms::screened_room(), dvec3(1e5, 1e5, -1e5)));
}

#[test]
fn in_an_acute_corner() {
    for degrees in [5.0, 0.5] {
        nobody_is_lost(|| rooms::wedge_room(degrees));
        nobody_is_lost(|| rooms::turned(rooms::wedge_room(degrees), DVec3::ZERO));
    }
}

#[test]
fn in_a_boulder() {
    nobody_is_lost(|| rooms::boulder(4));
}

#[test]
fn in_a_furnished_hall() {
    nobody_is_lost(|| rooms::furnished_hall(20));
}

#[test]
fn walkers_who_do_not_leave_properly_are_lost() {
    let carelessly = |_: &Geometry, hit: &Hit| Departure::free(hit.position);
    assert!(lost(rooms::turned(rooms::shoebox(), DVec3::ZERO), Gait::Mirror, carelessly) > 0);
}
