//! Closed shells where more than two faces meet at an edge.

use crate::rooms;
use glam::{DVec3, dvec3};
use sonel_geometry::{Geometry, Mesh};

/// The triangles of a box from one corner to another.
fn add_box(mesh: &mut Mesh, low: DVec3, high: DVec3) {
    let solid = Mesh::shoebox((high - low).to_array(), [1; 6]);
    for triangle in 0..12 {
        rooms::add(mesh, 1, &[solid.corners(triangle).map(|corner| corner + low)]);
    }
}

fn add_polygon(mesh: &mut Mesh, corners: &[[f64; 3]]) {
    for pair in corners[1..].windows(2) {
        rooms::add(mesh, 0, &[[corners[0], pair[0], pair[1]].map(DVec3::from)]);
    }
}

/// A hall of 12 × 8 × 5 m and a foyer of 6 × 8 × 3 m behind its wall at x = 12 m, a sheet with a door of 2 × 2.2 m. Faces above the door
/// share their corners or not.
fn hall_and_foyer(shares_corners: bool) -> Mesh {
    let mut mesh = Mesh::default();
    let mut add = |corners: &[[f64; 3]]| add_polygon(&mut mesh, corners);
    add(&[[0.0, 0.0, 0.0], [12.0, 0.0, 0.0], [12.0, 8.0, 0.0], [0.0, 8.0, 0.0]]);
    add(&[[0.0, 0.0, 5.0], [0.0, 8.0, 5.0], [12.0, 8.0, 5.0], [12.0, 0.0, 5.0]]);
    add(&[[0.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 8.0, 5.0], [0.0, 0.0, 5.0]]);
    add(&[[0.0, 0.0, 0.0], [0.0, 0.0, 5.0], [12.0, 0.0, 5.0], [12.0, 0.0, 3.0], [12.0, 0.0, 0.0]]);
    add(&[[12.0, 8.0, 5.0], [0.0, 8.0, 5.0], [0.0, 8.0, 0.0], [12.0, 8.0, 0.0], [12.0, 8.0, 3.0]]);
    add(&[[12.0, 0.0, 0.0], [12.0, 3.0, 0.0], [12.0, 3.0, 3.0], [12.0, 0.0, 3.0]]);
    add(&[[12.0, 5.0, 0.0], [12.0, 8.0, 0.0], [12.0, 8.0, 3.0], [12.0, 5.0, 3.0]]);
    add(&[[12.0, 3.0, 2.2], [12.0, 5.0, 2.2], [12.0, 5.0, 3.0], [12.0, 3.0, 3.0]]);
    let steps = if shares_corners { &[0.0, 3.0, 5.0, 8.0][..] } else { &[0.0, 8.0] };
    for pair in steps.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        add(&[[12.0, from, 3.0], [12.0, to, 3.0], [12.0, to, 5.0], [12.0, from, 5.0]]);
        add(&[[12.0, from, 3.0], [12.0, to, 3.0], [18.0, to, 3.0], [18.0, from, 3.0]]);
    }
    add(&[[12.0, 0.0, 0.0], [18.0, 0.0, 0.0], [18.0, 8.0, 0.0], [12.0, 8.0, 0.0]]);
    add(&[[18.0, 0.0, 0.0], [18.0, 0.0, 3.0], [18.0, 8.0, 3.0], [18.0, 8.0, 0.0]]);
    add(&[[12.0, 0.0, 0.0], [12.0, 0.0, 3.0], [18.0, 0.0, 3.0], [18.0, 0.0, 0.0]]);
    add(&[[12.0, 8.0, 0.0], [18.0, 8.0, 0.0], [18.0, 8.0, 3.0], [12.0, 8.0, 3.0]]);
    mesh
}

#[test]
fn a_wall_between_two_rooms_may_share_its_upper_edge_with_a_ceiling() {
    let diffracting = |geometry: &Geometry| {
        let mut lengths: Vec<f64> = geometry.diffracting_edges().map(|edge| edge.length()).collect();
        lengths.sort_by(f64::total_cmp);
        lengths
    };
    let plain = Geometry::build(hall_and_foyer(false)).unwrap();
    for shift in [None, Some(dvec3(0.0, 1e3, 0.0))] {
        let mesh = hall_and_foyer(true);
        let shared = shift.map_or(mesh.clone(), |shift| rooms::turned(mesh, shift));
        let shared = Geometry::build(shared).unwrap();
        assert!(shared.is_watertight() && shared.open_edges().is_empty());
        assert!((shared.volume().unwrap() - 624.0).abs() < 1e-6);
        assert!((shared.area() - 563.2).abs() < 1e-6 && (plain.area() - 563.2).abs() < 1e-6);
        let [shared, plain] = [&shared, &plain].map(diffracting);
        assert_eq!((shared.len(), plain.len()), (3, 3));
        assert!(shared.iter().zip(&plain).all(|(a, b)| (a - b).abs() < 1e-6), "{shared:?} {plain:?}");
    }
}

/// Without the door the wall closes either room, and both have air.
#[test]
fn a_wall_that_closes_two_rooms_is_exposed_on_both_sides() {
    let mut mesh = hall_and_foyer(true);
    add_polygon(&mut mesh, &[[12.0, 3.0, 0.0], [12.0, 5.0, 0.0], [12.0, 5.0, 2.2], [12.0, 3.0, 2.2]]);
    let geometry = Geometry::build(mesh).unwrap();
    assert!((geometry.volume().unwrap() - 624.0).abs() < 1e-9);
    assert!((geometry.area() - (563.2 + 2.0 * 4.4)).abs() < 1e-9);
    assert!(geometry.contains(dvec3(1.0, 1.0, 1.0)) && geometry.contains(dvec3(17.0, 1.0, 1.0)));
}

/// The same with a hole in the ceiling of the foyer.
#[test]
fn a_hole_opens_both_rooms() {
    let mut mesh = hall_and_foyer(true);
    let is_ceiling = |corners: [DVec3; 3]| {
        corners.iter().all(|corner| (corner.z - 3.0).abs() < 1e-9)
            && corners.iter().any(|corner| (corner.x - 18.0).abs() < 1e-9)
    };
    let first = (0..mesh.triangles.len() as u32).find(|&t| is_ceiling(mesh.corners(t))).unwrap();
    mesh.triangles.remove(first as usize);
    let geometry = Geometry::build(mesh).unwrap();
    assert!(!geometry.is_closed_room() && !geometry.open_edges().is_empty());
}

/// Steps of boxes, the last one at the end wall, all from wall to wall.
#[test]
fn steps_of_flush_boxes_leave_the_air_above_them() {
    for shift in [None, Some(dvec3(0.0, 1e3, 0.0))] {
        let mut mesh = Mesh::shoebox([8.0, 6.0, 3.0], [0; 6]);
        add_box(&mut mesh, dvec3(5.0, 0.0, 0.0), dvec3(6.0, 6.0, 0.3));
        add_box(&mut mesh, dvec3(6.0, 0.0, 0.0), dvec3(8.0, 6.0, 0.6));
        let mesh = shift.map_or(mesh.clone(), |shift| rooms::turned(mesh, shift));
        let geometry = Geometry::build(mesh).unwrap();
        assert!((geometry.volume().unwrap() - 135.0).abs() < 1e-6);
        assert!((geometry.area() - 177.0).abs() < 1e-6, "{}", geometry.area());
        assert_eq!((geometry.is_watertight(), geometry.diffracting_edges().count()), (true, 2));
    }
}

/// The floor has a corner within the edge that the end wall shares with a stage.
#[test]
fn an_edge_of_four_faces_may_have_a_t_junction() {
    for shift in [None, Some(dvec3(0.0, 1e3, 0.0))] {
        let mut mesh = Mesh::shoebox([8.0, 6.0, 3.0], [0; 6]);
        mesh.triangles.retain(|triangle| triangle.corners.iter().any(|&c| mesh.vertices[c as usize].z > 1.0));
        for [from, to] in [[0.0, 2.5], [2.5, 6.0]] {
            add_polygon(&mut mesh, &[[0.0, from, 0.0], [8.0, from, 0.0], [8.0, to, 0.0], [0.0, to, 0.0]]);
        }
        add_box(&mut mesh, dvec3(5.0, 0.0, 0.0), dvec3(8.0, 6.0, 0.9));
        let mesh = shift.map_or(mesh.clone(), |shift| rooms::turned(mesh, shift));
        let geometry = Geometry::build(mesh).unwrap();
        assert!((geometry.volume().unwrap() - 127.8).abs() < 1e-6);
        assert!((geometry.area() - 174.6).abs() < 1e-6, "{}", geometry.area());
    }
}

/// The slab's bottom has the corners of the floor: both are in no air.
#[test]
fn a_slab_over_the_whole_floor_hides_it() {
    let mut mesh = Mesh::shoebox([8.0, 6.0, 3.0], [0; 6]);
    add_box(&mut mesh, DVec3::ZERO, dvec3(8.0, 6.0, 0.2));
    assert!(mesh.mended(1e-3).is_none());
    let geometry = Geometry::build(mesh).unwrap();
    assert!((geometry.volume().unwrap() - 134.4).abs() < 1e-9);
    assert!((geometry.area() - (2.0 * 48.0 + 28.0 * 2.8)).abs() < 1e-9, "{}", geometry.area());
    assert!(!geometry.contains(dvec3(4.0, 3.0, 0.1)) && geometry.contains(dvec3(4.0, 3.0, 0.3)));
}

#[test]
fn boxes_that_touch_along_an_edge_are_two_solids() {
    for shift in [None, Some(dvec3(0.0, 1e3, 0.0))] {
        let mut mesh = Mesh::shoebox([8.0, 6.0, 3.0], [0; 6]);
        add_box(&mut mesh, dvec3(3.0, 2.0, 1.0), dvec3(4.0, 3.0, 2.0));
        add_box(&mut mesh, dvec3(4.0, 3.0, 1.0), dvec3(5.0, 4.0, 2.0));
        let mesh = shift.map_or(mesh.clone(), |shift| rooms::turned(mesh, shift));
        let geometry = Geometry::build(mesh).unwrap();
        assert!((geometry.volume().unwrap() - 142.0).abs() < 1e-6);
        assert!((geometry.area() - (180.0 + 12.0)).abs() < 1e-6);
        // All but the common one, with right angles of air on both sides.
        assert_eq!(geometry.diffracting_edges().count(), 22);
    }
}

/// A beam in the corner of floor and end wall, with air between it and both.
#[test]
fn a_solid_may_touch_the_hull_along_an_edge() {
    let mut mesh = Mesh::shoebox([8.0, 6.0, 3.0], [0; 6]);
    let at = |y: f64| [[8.0, y, 0.0], [7.0, y, 0.5], [7.5, y, 1.0]].map(DVec3::from);
    let ([a, b, c], [d, e, f]) = (at(0.0), at(6.0));
    rooms::add(&mut mesh, 1, &[[a, b, c], [d, e, f]]);
    for [p, q, r, s] in [[a, b, e, d], [b, c, f, e], [c, a, d, f]] {
        rooms::add_quad(&mut mesh, 1, [p, q, r, s]);
    }
    let geometry = Geometry::build(mesh).unwrap();
    assert!((geometry.volume().unwrap() - (144.0 - 6.0 * 0.375)).abs() < 1e-9);
    assert!(!geometry.contains(dvec3(7.5, 3.0, 0.5)) && geometry.contains(dvec3(7.9, 3.0, 1.0)));
}
