//! Vertices within the resolution are joined, triangles without area dropped, bad meshes refused.

use crate::numbers::Numbers;
use crate::rooms;
use glam::{DVec3, dvec3};
use sonel_geometry::{Geometry, GeometryError, Mesh, MeshTriangle};

#[test]
fn vertices_of_separate_triangles_are_joined() {
    let soup = rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 8);
    let welded = soup.welded();
    assert_eq!(soup.vertices.len(), 6 * 8 * 8 * 6);
    assert_eq!(welded.mesh.vertices.len(), 6 * 8 * 8 + 2);
    assert_eq!((welded.mesh.triangles.len(), welded.dropped), (soup.triangles.len(), 0));
}

#[test]
fn near_coincident_vertices_are_joined_and_distinct_ones_are_not() {
    let resolution = f64::from(Geometry::build(rooms::boulder(3)).unwrap().resolution());
    let mut numbers = Numbers(1);
    let mut shaken = |by: f64| {
        let mut soup = Mesh::default();
        let whole = rooms::boulder(3);
        for triangle in &whole.triangles {
            let corners = triangle.corners.map(|c| whole.vertices[c as usize] + by * numbers.direction());
            rooms::add(&mut soup, 0, &[corners]);
        }
        soup.welded().mesh.vertices.len()
    };
    let vertices = rooms::boulder(3).vertices.len();
    assert_eq!(shaken(0.2 * resolution), vertices);
    assert!(shaken(5.0 * resolution) > 2 * vertices);
}

#[test]
fn triangles_without_area_are_dropped_and_counted() {
    let mut mesh = rooms::shoebox();
    let corner = |x: f64| dvec3(x, 1.0, 1.0);
    rooms::add(
        &mut mesh,
        0,
        &[[corner(1.0), corner(2.0), corner(3.0)], [corner(1.0), corner(1.0), DVec3::ONE]],
    );
    let geometry = Geometry::build(mesh).unwrap();
    assert_eq!(geometry.dropped_triangles(), 2);
    assert_eq!(geometry.mesh().triangles.len(), 12);
    assert!(geometry.as_shoebox().is_some());
}

#[test]
fn bad_meshes_are_refused_with_the_place() {
    let refusal = |mesh| Geometry::build(mesh).err();
    assert_eq!(refusal(Mesh::default()), Some(GeometryError::Empty { dropped: 0 }));
    let mut mesh = rooms::shoebox();
    mesh.vertices[3].y = f64::NAN;
    mesh.vertices[5].z = f64::INFINITY;
    assert_eq!(refusal(mesh), Some(GeometryError::NotFinite { first: 3, count: 2 }));
    let mut mesh = rooms::shoebox();
    mesh.triangles.push(MeshTriangle { corners: [0, 1, 8], material: 0 });
    assert_eq!(refusal(mesh), Some(GeometryError::NoSuchVertex { first: 12, count: 1 }));
    let mut point = rooms::shoebox();
    point.vertices.fill(DVec3::ONE);
    assert_eq!(refusal(point), Some(GeometryError::Empty { dropped: 12 }));
}

/// Sheets across a box, `count` across each axis.
fn lattice(count: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for (axis, at) in (0..3).flat_map(|axis| (1..=count).map(move |at| (axis, f64::from(at)))) {
        let side = f64::from(count + 1);
        let corner = |u: f64, v: f64| {
            let mut place = DVec3::splat(at);
            (place[(axis + 1) % 3], place[(axis + 2) % 3]) = (u, v);
            place
        };
        let [a, b, c, d] = [corner(0.0, 0.0), corner(side, 0.0), corner(side, side), corner(0.0, side)];
        rooms::add(&mut mesh, 0, &[[a, b, c], [a, c, d]]);
    }
    mesh
}

#[test]
fn faces_that_cross_everywhere_are_refused_and_a_few_crossings_are_not() {
    let refused =
        |count: u32| matches!(Geometry::build(lattice(count)), Err(GeometryError::Tangled { most: 500_000 }));
    assert!(refused(64));
    assert!(!refused(4));
}
