//! Whatever way round the triangles come, normals end up facing the air.

use crate::numbers::Numbers;
use crate::rooms;
use glam::{DVec3, dvec3};
use sonel_geometry::{Geometry, Mesh, MeshTriangle};

fn shuffled(mut mesh: Mesh, seed: u64) -> Mesh {
    let mut numbers = Numbers(seed);
    for triangle in &mut mesh.triangles {
        if numbers.unit() < 0.5 {
            triangle.corners.swap(0, 1);
        }
    }
    mesh
}

fn with_box(mut mesh: Mesh, low: DVec3, size: f64, material: u32) -> Mesh {
    let object = Mesh::shoebox([size; 3], [material; 6]);
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(object.vertices.iter().map(|&v| v + low));
    let moved = |t: &MeshTriangle| MeshTriangle { corners: t.corners.map(|c| c + first), material };
    mesh.triangles.extend(object.triangles.iter().map(moved));
    mesh
}

/// Whether every normal points away from the point that is inside (+1) or outside (−1) of each material's convex part.
fn faces(geometry: &Geometry, material: u32, middle: DVec3) -> bool {
    let mut surfaces = geometry.surfaces().iter().filter(|s| s.material == material).peekable();
    assert!(surfaces.peek().is_some());
    surfaces.all(|s| s.normal.dot(middle) > s.offset)
}

#[test]
fn hulls_face_inward_and_objects_outward() {
    for seed in 0..20 {
        let mesh = with_box(Mesh::shoebox([10.0, 8.0, 6.0], [0; 6]), DVec3::splat(2.0), 2.0, 1);
        // In the object a closed cavity, whose air is its inside.
        let mesh = with_box(mesh, DVec3::splat(2.5), 1.0, 2);
        let geometry = Geometry::build(shuffled(mesh, seed)).unwrap();
        assert_eq!(geometry.surfaces().len(), 18);
        assert!(geometry.is_closed_room());
        assert!(faces(&geometry, 0, dvec3(5.0, 4.0, 3.0)));
        assert!(faces(&geometry, 2, DVec3::splat(3.0)));
        let outward = |s: &&sonel_geometry::Surface| s.material == 1;
        for surface in geometry.surfaces().iter().filter(outward) {
            assert!(surface.normal.dot(DVec3::splat(3.0)) < surface.offset);
        }
        assert!((geometry.volume().unwrap() - (480.0 - 8.0 + 1.0)).abs() < 1e-9);
    }
}

/// On the ground or above it, a closed object is heard from outside: it faces outward, has both sides, and its outer edges
/// diffract. A hut without ground is a room.
#[test]
fn in_the_open_objects_face_outward() {
    let ground = Mesh {
        vertices: [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]
            .map(|[x, y]| dvec3(x, y, 0.0))
            .to_vec(),
        triangles: [[0, 1, 2], [0, 2, 3]].map(|corners| MeshTriangle { corners, material: 0 }).to_vec(),
    };
    for (seed, height, edges) in [(1, 0.0, 8), (2, 0.5, 12)] {
        let mesh = with_box(ground.clone(), dvec3(2.0, 2.0, height), 2.0, 1);
        let geometry = Geometry::build(shuffled(mesh, seed)).unwrap();
        assert!(!geometry.is_closed_room());
        let middle = dvec3(3.0, 3.0, 1.0 + height);
        let walls = || geometry.surfaces().iter().filter(|surface| surface.material == 1);
        assert!(walls().all(|wall| wall.normal.dot(middle) < wall.offset && !wall.closed));
        let is_of_box = |edge: &&sonel_geometry::Edge| edge.ends.iter().all(|end| end.distance(middle) < 1.8);
        assert_eq!(geometry.diffracting_edges().filter(is_of_box).count(), edges, "{height} m above ground");
        let alone = with_box(Mesh::default(), dvec3(2.0, 2.0, height), 2.0, 1);
        assert!(Geometry::build(shuffled(alone, seed)).unwrap().contains(middle));
    }
}

#[test]
fn an_object_that_stands_on_the_floor_is_inside_all_the_same() {
    for seed in 0..20 {
        let mesh = with_box(Mesh::shoebox([10.0, 8.0, 6.0], [0; 6]), dvec3(2.0, 2.0, 0.0), 2.0, 1);
        let geometry = Geometry::build(shuffled(mesh, seed)).unwrap();
        assert!((geometry.volume().unwrap() - 472.0).abs() < 1e-9);
        assert!(!geometry.contains(dvec3(3.0, 3.0, 1.0)));
        assert!(geometry.contains(dvec3(3.0, 3.0, 2.5)));
        assert!(
            geometry
                .surfaces()
                .iter()
                .filter(|s| s.material == 1 && s.normal.z.abs() < 0.5)
                .all(|s| { s.normal.dot(dvec3(3.0, 3.0, 1.0)) < s.offset })
        );
    }
}

#[test]
fn an_l_shaped_room_and_a_boulder_face_inward() {
    for seed in 0..5 {
        let room = Geometry::build(shuffled(rooms::l_room(), seed)).unwrap();
        assert!((room.volume().unwrap() - 39.0 * 3.0).abs() < 1e-9);
        let boulder = Geometry::build(shuffled(rooms::boulder(2), seed)).unwrap();
        // A point near the middle sees every facet's front when the surface is star-shaped about it.
        assert!(faces(&boulder, 0, DVec3::ZERO));
    }
}

#[test]
fn a_screen_welded_to_the_floor_does_not_open_the_room() {
    // Floor vertices along the foot of the screen: three faces at one edge.
    let mut mesh = rooms::tessellated_box(dvec3(4.0, 4.0, 2.0), 4);
    let foot = [dvec3(1.0, 1.0, 0.0), dvec3(1.0, 2.0, 0.0)];
    rooms::add_quad(&mut mesh, 9, [foot[0], foot[1], foot[1] + DVec3::Z, foot[0] + DVec3::Z]);
    for seed in 0..5 {
        let geometry = Geometry::build(shuffled(mesh.clone(), seed)).unwrap();
        assert!(geometry.is_closed_room());
        assert!((geometry.volume().unwrap() - 32.0).abs() < 1e-12);
        assert!((geometry.exposed_area(9) - 2.0).abs() < 1e-12);
        assert_eq!(geometry.surfaces().len(), 7);
    }
}

#[test]
fn an_open_shell_is_oriented_alike_but_closes_no_room() {
    let mut mesh = rooms::shoebox();
    mesh.triangles.truncate(10);
    let geometry = Geometry::build(shuffled(mesh, 3)).unwrap();
    assert!(!geometry.is_closed_room() && geometry.volume().is_none());
    assert!(!geometry.contains(dvec3(5.0, 3.0, 1.0)));
    let middle = dvec3(5.0, 3.5, 1.5);
    let inward = geometry.surfaces().iter().filter(|s| s.normal.dot(middle) > s.offset).count();
    assert!(inward == 0 || inward == 5);
    // Nothing is in front of the outer sides.
    assert!((geometry.area() - (242.0 - 70.0)).abs() < 1e-9);
}
