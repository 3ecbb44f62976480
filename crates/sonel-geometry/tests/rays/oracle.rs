//! Against an exhaustive search in `f64`, whose triangle test shares nothing with ours.

use crate::numbers::Numbers;
use crate::rooms;
use glam::{DVec3, dvec3};
use sonel_geometry::{Departure, Geometry, Mesh, MeshTriangle, Side};

/// A crossing of a line with the mesh.
#[derive(Clone, Copy)]
struct Crossing {
    distance: f64,
    triangle: u32,
    /// Distance from the triangle's rim, relative to its size.
    from_rim: f64,
}

/// Every crossing in front of the origin, near to far; world coordinates of the rounded origin.
fn crossings(geometry: &Geometry, origin: DVec3, direction: DVec3) -> Vec<Crossing> {
    let mesh = geometry.mesh();
    let mut crossings: Vec<Crossing> = (0..mesh.triangles.len() as u32)
        .filter_map(|triangle| {
            let [a, b, c] =
                mesh.triangles[triangle as usize].corners.map(|corner| mesh.vertices[corner as usize]);
            let normal = (b - a).cross(c - a);
            let distance = normal.dot(a - origin) / normal.dot(direction);
            let point = origin + distance * direction;
            let share = |p: DVec3, q: DVec3| normal.dot((q - p).cross(point - p)) / normal.length_squared();
            let from_rim = share(a, b).min(share(b, c)).min(share(c, a));
            (distance > 0.0 && from_rim >= 0.0).then_some(Crossing { distance, triangle, from_rim })
        })
        .collect();
    crossings.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    crossings
}

/// Compares closest hits and shadow rays; rays too near a rim or between two nearly equal hits have no one answer and
/// must be rare.
fn agree(mesh: Mesh, rays: usize) {
    let geometry = Geometry::build(mesh).unwrap();
    let (low, high) = geometry.bounds();
    let mut numbers = Numbers(13);
    let mut undecided = 0;
    for _ in 0..rays {
        let from = geometry.to_local(numbers.within(low, high));
        let to = geometry.to_local(numbers.within(low, high));
        let direction = (to - from).normalize();
        let expected = crossings(&geometry, geometry.to_world(from), direction.as_dvec3());
        let found = geometry.closest_hit(Departure::free(from), direction);
        let clear = 20.0 * f64::from(geometry.resolution());
        let doubtful = expected.iter().take(2).any(|c| c.from_rim < 1e-4 || c.distance < clear)
            || expected.windows(2).take(1).any(|pair| pair[1].distance - pair[0].distance < 1e-4);
        if doubtful {
            undecided += 1;
            continue;
        }
        match (expected.first(), found) {
            (None, None) => {}
            (Some(expected), Some(hit)) => {
                assert_eq!(hit.triangle, expected.triangle);
                let grazing = geometry.surface(hit.surface).normal.dot(direction.as_dvec3()).abs();
                assert!((f64::from(hit.distance) - expected.distance).abs() * grazing < clear);
            }
            (expected, found) => panic!("{:?} but {found:?}", expected.map(|e| e.triangle)),
        }
        let reach = f64::from(from.distance(to));
        if expected.iter().all(|c| (c.distance - reach).abs() > 1e-3 && c.from_rim > 1e-4) {
            let blocked = expected.iter().any(|c| c.distance < reach);
            assert_eq!(geometry.is_blocked(Departure::free(from), to), blocked);
        }
    }
    assert!(undecided < rays / 50, "{undecided} of {rays} undecided");
}

#[test]
fn in_a_furnished_hall() {
    agree(rooms::furnished_hall(200), 20_000);
}

#[test]
fn in_a_boulder() {
    agree(rooms::boulder(3), 20_000);
}

#[test]
fn in_a_screened_room_by_scanning() {
    agree(rooms::turned(rooms::screened_room(), DVec3::ZERO), 100_000);
}

#[test]
fn of_coincident_sheets_the_first_facing_one_is_met() {
    // A carpet in the plane of the floor, and a panel of two sheets back to back.
    let mut mesh = rooms::shoebox();
    let square =
        |x: f64, z: f64| [dvec3(x, 1.0, z), dvec3(x + 1.0, 1.0, z), dvec3(x + 1.0, 2.0, z), dvec3(x, 2.0, z)];
    let turned_over = |[a, b, c, d]: [DVec3; 4]| [d, c, b, a];
    rooms::add_quad(&mut mesh, 7, square(1.0, 0.0));
    rooms::add_quad(&mut mesh, 8, square(4.0, 1.0));
    rooms::add_quad(&mut mesh, 9, turned_over(square(4.0, 1.0)));
    let geometry = Geometry::build(mesh).unwrap();
    let met = |from: DVec3, direction: DVec3| {
        let hit =
            geometry.closest_hit(Departure::free(geometry.to_local(from)), direction.as_vec3()).unwrap();
        (geometry.surface(hit.surface).material, hit.side)
    };
    let mut numbers = Numbers(17);
    for _ in 0..1000 {
        let aside = 0.3 * dvec3(numbers.unit(), numbers.unit(), 0.0);
        assert_eq!(met(dvec3(1.4, 1.4, 0.5) + aside, DVec3::NEG_Z), (4, Side::Front));
        assert_eq!(met(dvec3(4.4, 1.4, 1.5) + aside, DVec3::NEG_Z), (8, Side::Front));
        assert_eq!(met(dvec3(4.4, 1.4, 0.5) + aside, DVec3::Z), (9, Side::Front));
    }
}

#[test]
fn the_order_of_triangles_decides_ties_and_nothing_else() {
    // The same ray on the edge between two triangles: whichever comes first in the mesh.
    let box_of = |reverse: bool| {
        let mut mesh = rooms::tessellated_box(dvec3(4.0, 4.0, 4.0), 4);
        if reverse {
            mesh.triangles.reverse();
        }
        let last = mesh.triangles.len() as u32 - 1;
        (Geometry::build(mesh).unwrap(), move |t: u32| if reverse { last - t } else { t })
    };
    let (forward, _) = box_of(false);
    let (backward, renamed) = box_of(true);
    // Up the z axis from (1, 1) ends in a vertex of four quads.
    let ray = |geometry: &Geometry| {
        let from = Departure::free(geometry.to_local(dvec3(1.0, 1.0, 1.0)));
        geometry.closest_hit(from, glam::Vec3::Z).unwrap().triangle
    };
    let around = |geometry: &Geometry| {
        let touches = |t: &MeshTriangle| {
            t.corners.iter().any(|&c| geometry.mesh().vertices[c as usize] == dvec3(1.0, 1.0, 4.0))
        };
        geometry.mesh().triangles.iter().position(touches).unwrap() as u32
    };
    assert_eq!(ray(&forward), around(&forward));
    assert_eq!(ray(&backward), around(&backward));
    assert_ne!(ray(&forward), renamed(ray(&backward)));
}
