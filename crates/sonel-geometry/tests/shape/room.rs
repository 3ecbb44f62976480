//! The enclosed air: inside, volume, area, distances, and the shoebox.

use crate::numbers::Numbers;
use crate::rooms;
use glam::{DVec3, dvec3};
use sonel_geometry::{Geometry, Mesh};

#[test]
fn a_point_is_in_the_l_shaped_room_when_its_plan_says_so() {
    let shift = dvec3(1e5, 1e5, -1e5);
    let plain = Geometry::build(rooms::l_room()).unwrap();
    let mut far = rooms::l_room();
    far.vertices.iter_mut().for_each(|v| *v += shift);
    let far = Geometry::build(far).unwrap();
    let mut numbers = Numbers(1);
    for _ in 0..10_000 {
        let point = numbers.within(DVec3::splat(-1.0), dvec3(9.0, 9.0, 4.0));
        let within = |low: DVec3, high: DVec3| point.cmpgt(low).all() && point.cmplt(high).all();
        let inside = within(DVec3::ZERO, dvec3(8.0, 3.0, 3.0)) || within(DVec3::ZERO, dvec3(3.0, 8.0, 3.0));
        assert_eq!(plain.contains(point), inside, "{point}");
        assert_eq!(far.contains(point + shift), inside, "{point}");
    }
    // On the straight continuation of edges and faces, where a ray would have been in doubt.
    assert!(plain.contains(dvec3(3.0, 2.0, 1.0)) && plain.contains(dvec3(1.0, 3.0, 1.5)));
    assert!(!plain.contains(dvec3(3.0, 9.0, 1.0)) && !plain.contains(dvec3(9.0, 3.0, 0.0)));
}

#[test]
fn distances_agree_with_the_closed_form_in_a_box() {
    let geometry = Geometry::build(rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 4)).unwrap();
    let size = dvec3(10.0, 7.0, 3.0);
    let mut numbers = Numbers(2);
    for _ in 0..5_000 {
        let point = numbers.within(DVec3::splat(-3.0), size + 3.0);
        let outside = (point - size).max(-point).max(DVec3::ZERO).length();
        let inside = point.min(size - point).min_element().max(0.0);
        let expected = if outside > 0.0 { outside } else { inside };
        assert!((geometry.distance_to_nearest_surface(point) - expected).abs() < 1e-12);
    }
}

#[test]
fn volume_and_area_of_a_sphere_converge() {
    let geometry = Geometry::build(rooms::sphere(5, 0.0)).unwrap();
    let (volume, area) = (4.0 / 3.0 * std::f64::consts::PI * 125.0, 4.0 * std::f64::consts::PI * 25.0);
    assert!((geometry.volume().unwrap() / volume - 1.0).abs() < 2e-3);
    assert!((geometry.area() / area - 1.0).abs() < 2e-3);
    assert!(geometry.volume().unwrap() < volume && geometry.area() < area);
}

#[test]
fn panels_are_exposed_on_both_sides_and_walls_on_one() {
    let geometry = Geometry::build(rooms::screened_room()).unwrap();
    assert!((geometry.exposed_area(6) - 12.0).abs() < 1e-12);
    assert!((geometry.exposed_area(0) - 21.0).abs() < 1e-12);
    assert!((geometry.volume().unwrap() - 210.0).abs() < 1e-9);
    assert!(geometry.is_closed_room() && geometry.as_shoebox().is_none());
}

#[test]
fn shoeboxes_are_recognised_and_nothing_else() {
    let shoebox = |mesh: Mesh| Geometry::build(mesh).unwrap().as_shoebox();
    let shift = dvec3(-300.0, 20.0, 5.0);
    let mut moved = rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 5);
    moved.vertices.iter_mut().for_each(|v| *v += shift);
    let found = shoebox(moved).unwrap();
    assert!(found.min.distance(shift) < 1e-9 && found.max.distance(shift + dvec3(10.0, 7.0, 3.0)) < 1e-9);
    assert!(shoebox(rooms::turned(rooms::shoebox(), DVec3::ZERO)).is_none());
    assert!(shoebox(rooms::l_room()).is_none());
    assert!(shoebox(rooms::furnished_hall(1)).is_none());
    // A box whose ceiling slopes by a millimetre.
    let mut sloping = rooms::shoebox();
    sloping.vertices.iter_mut().filter(|v| v.z > 1.0 && v.x > 1.0).for_each(|v| v.z += 1e-3);
    assert!(shoebox(sloping).is_none());
    // Six walls of the right size, but apart: no closed shell.
    let mut open = rooms::shoebox();
    open.triangles.swap_remove(11);
    assert!(shoebox(open).is_none());
}

#[test]
fn two_rooms_side_by_side_are_no_closed_room() {
    let mut mesh = rooms::shoebox();
    let second = rooms::shoebox();
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(second.vertices.iter().map(|&v| v + dvec3(20.0, 0.0, 0.0)));
    mesh.triangles.extend(second.triangles.iter().map(|t| sonel_geometry::MeshTriangle {
        corners: t.corners.map(|c| c + first),
        material: t.material,
    }));
    let geometry = Geometry::build(mesh).unwrap();
    assert!(!geometry.is_closed_room());
    assert!(!geometry.contains(dvec3(5.0, 3.0, 1.0)));
}

#[test]
fn t_junctions_are_closed() {
    for mesh in [rooms::carelessly_drawn_box(), rooms::turned(rooms::carelessly_drawn_box(), DVec3::ONE)] {
        let drawn = mesh.triangles.len();
        let geometry = Geometry::build(mesh).unwrap();
        assert!(geometry.is_closed_room() && geometry.mesh().triangles.len() > drawn);
        assert_eq!((geometry.surfaces().len(), geometry.edges().len()), (6, 12));
        assert!((geometry.volume().unwrap() - 210.0).abs() < 1e-4);
    }
}

/// A hole of 1 m² in the ceiling: the outer sides of the walls are no part of the room.
#[test]
fn walls_of_a_room_with_a_hole_count_once() {
    let mut mesh = sonel_geometry::Mesh::shoebox([6.0, 5.0, 3.0], [0, 0, 0, 0, 1, 0]);
    mesh.triangles.truncate(10);
    let at = |x: f64, y: f64| dvec3(x, y, 3.0);
    for [from, to] in [
        [at(0.0, 0.0), at(6.0, 2.0)],
        [at(0.0, 3.0), at(6.0, 5.0)],
        [at(0.0, 2.0), at(2.0, 3.0)],
        [at(3.0, 2.0), at(6.0, 3.0)],
    ] {
        rooms::add_quad(&mut mesh, 0, [from, at(to.x, from.y), to, at(from.x, to.y)]);
    }
    // A screen in it has air on both sides.
    rooms::add_quad(
        &mut mesh,
        2,
        [dvec3(2.0, 1.0, 0.5), dvec3(4.0, 1.0, 0.5), dvec3(4.0, 1.0, 1.5), dvec3(2.0, 1.0, 1.5)],
    );
    let geometry = Geometry::build(mesh).unwrap();
    assert!(!geometry.is_closed_room());
    assert!((geometry.area() - (126.0 - 1.0 + 4.0)).abs() < 1e-9, "{}", geometry.area());
    assert!((geometry.exposed_area(1) - 30.0).abs() < 1e-9 && (geometry.exposed_area(2) - 4.0).abs() < 1e-9);
}

/// A solid that pokes through a wall, and a wall drawn a little too long, leave a room.
#[test]
fn what_pokes_through_a_wall_leaves_a_room() {
    let mut mesh = sonel_geometry::Mesh::shoebox([6.0, 5.0, 3.0], [0; 6]);
    let solid = sonel_geometry::Mesh::shoebox([1.0, 1.0, 1.0], [1; 6]);
    for triangle in 0..12 {
        rooms::add(&mut mesh, 1, &[solid.corners(triangle).map(|corner| corner + dvec3(5.5, 2.0, 1.0))]);
    }
    rooms::add_quad(
        &mut mesh,
        2,
        [dvec3(2.0, -0.1, 0.0), dvec3(2.0, 3.0, 0.0), dvec3(2.0, 3.0, 3.0), dvec3(2.0, -0.1, 3.0)],
    );
    let geometry = Geometry::build(mesh).unwrap();
    assert!(geometry.is_watertight());
    assert!((geometry.volume().unwrap() - (90.0 - 0.5 + 0.5)).abs() < 1e-9, "{}", geometry.volume().unwrap());
    assert!(geometry.contains(dvec3(1.0, 1.0, 1.0)) && !geometry.contains(dvec3(5.7, 2.5, 1.5)));
}
