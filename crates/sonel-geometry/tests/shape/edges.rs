//! Edges: whole, of the right kind, with the right angle.

use crate::rooms;
use glam::{DVec3, dvec3};
use sonel_geometry::{Edge, EdgeShape, Geometry};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn of_shape(geometry: &Geometry, shape: EdgeShape) -> Vec<&Edge> {
    geometry.edges().iter().filter(|edge| edge.shape == shape).collect()
}

#[test]
fn a_box_has_twelve_concave_edges_however_tessellated() {
    for mesh in [
        rooms::shoebox(),
        rooms::turned(rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 16), dvec3(1e5, 0.0, 0.0)),
    ] {
        let geometry = Geometry::build(mesh).unwrap();
        assert_eq!(geometry.edges().len(), 12);
        let concave = of_shape(&geometry, EdgeShape::Concave);
        assert!(concave.len() == 12 && concave.iter().all(|e| (e.wedge_angle - FRAC_PI_2).abs() < 1e-6));
        let total: f64 = concave.iter().map(|edge| edge.length()).sum();
        assert!((total - 80.0).abs() < 1e-6);
        assert!(concave.iter().all(|edge| edge.surfaces.len() == 2));
    }
}

#[test]
fn an_l_shaped_room_has_one_convex_edge() {
    let geometry = Geometry::build(rooms::turned(rooms::l_room(), DVec3::ZERO)).unwrap();
    let convex = of_shape(&geometry, EdgeShape::Convex);
    assert_eq!((convex.len(), geometry.edges().len()), (1, 18));
    assert!((convex[0].wedge_angle - 1.5 * PI).abs() < 1e-9);
    assert!((convex[0].length() - 3.0).abs() < 1e-9);
}

#[test]
fn a_needle_of_a_room_has_a_needle_of_an_angle() {
    let geometry = Geometry::build(rooms::wedge_room(5.0)).unwrap();
    let sharpest = geometry.edges().iter().map(|edge| edge.wedge_angle).fold(TAU, f64::min);
    assert!((sharpest - 5f64.to_radians()).abs() < 1e-9);
}

#[test]
fn a_screen_is_free_but_for_its_foot() {
    for mesh in [rooms::screened_room(), rooms::turned(rooms::screened_room(), dvec3(0.0, 1e4, 0.0))] {
        let geometry = Geometry::build(mesh).unwrap();
        let free = of_shape(&geometry, EdgeShape::Free);
        assert!(free.len() == 3 && free.iter().all(|edge| (edge.wedge_angle - TAU).abs() < 1e-12));
        let length: f64 = free.iter().map(|edge| edge.length()).sum();
        assert!((length - 7.0).abs() < 1e-9);
        let foot = of_shape(&geometry, EdgeShape::Abutting);
        assert!(foot.len() == 1 && (foot[0].length() - 3.0).abs() < 1e-9);
    }
}

#[test]
fn a_change_of_material_is_a_seam_and_a_welded_foot_a_junction() {
    let mut mesh = rooms::tessellated_box(dvec3(4.0, 4.0, 2.0), 4);
    for triangle in mesh.triangles.iter_mut().filter(|t| t.material == 4).take(16) {
        triangle.material = 10;
    }
    let foot = [dvec3(1.0, 1.0, 0.0), dvec3(1.0, 2.0, 0.0)];
    rooms::add_quad(&mut mesh, 9, [foot[0], foot[1], foot[1] + DVec3::Z, foot[0] + DVec3::Z]);
    let geometry = Geometry::build(mesh).unwrap();
    let seams = of_shape(&geometry, EdgeShape::Seam);
    assert!(seams.len() == 1 && (seams[0].length() - 4.0).abs() < 1e-12);
    let junctions = of_shape(&geometry, EdgeShape::Junction);
    assert!(junctions.len() == 1 && (junctions[0].length() - 1.0).abs() < 1e-12);
}

#[test]
fn a_pillar_has_free_sides_and_an_abutting_foot_and_head() {
    let mut mesh = rooms::shoebox();
    let pillar = sonel_geometry::Mesh::shoebox([0.5, 0.6, 3.0], [7; 6]);
    for triangle in &pillar.triangles {
        let corners = triangle.corners.map(|c| pillar.vertices[c as usize] + dvec3(4.0, 2.0, 0.0));
        rooms::add(&mut mesh, 7, &[corners]);
    }
    for mesh in [mesh.clone(), rooms::turned(mesh, dvec3(0.0, 1e4, 0.0))] {
        let geometry = Geometry::build(mesh).unwrap();
        let convex = of_shape(&geometry, EdgeShape::Convex);
        assert!(convex.len() == 4 && convex.iter().all(|edge| (edge.length() - 3.0).abs() < 1e-9));
        assert!(convex.iter().all(|edge| (edge.wedge_angle - 1.5 * PI).abs() < 1e-9));
        assert_eq!(of_shape(&geometry, EdgeShape::Abutting).len(), 8);
        assert_eq!(of_shape(&geometry, EdgeShape::Concave).len(), 12);
    }
}
