//! Surfaces are what is flat, connected and of one material; planes are shared by all that is coplanar.

use crate::rooms;
use glam::{DVec3, dvec3};
use sonel_geometry::{Geometry, SurfaceId};
use std::collections::HashSet;

#[test]
fn a_tessellated_wall_is_one_surface() {
    for mesh in [
        rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 32),
        rooms::turned(rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 32), dvec3(1e5, 1e5, -1e5)),
    ] {
        let geometry = Geometry::build(mesh).unwrap();
        assert_eq!(geometry.surfaces().len(), 6);
        let total: f64 = geometry.surfaces().iter().map(|s| s.area).sum();
        assert!((total - 242.0).abs() < 1e-6);
        for (index, surface) in geometry.surfaces().iter().enumerate() {
            assert!((surface.normal.length() - 1.0).abs() < 1e-12);
            assert!((surface.normal.dot(surface.centroid) - surface.offset).abs() < 1e-6);
            assert_eq!(surface.triangles.len(), 2 * 32 * 32);
            for &triangle in &surface.triangles {
                assert_eq!(geometry.triangle_surface(triangle), SurfaceId(index as u32));
            }
        }
    }
}

#[test]
fn a_curved_surface_is_never_chained_into_one_plane() {
    // Facets of 8 cm on a radius of 5 m meet at less than a degree, the next but one already lie off the plane.
    let geometry = Geometry::build(rooms::sphere(6, 0.0)).unwrap();
    assert_eq!(geometry.surfaces().len(), geometry.mesh().triangles.len());
    // A cylinder of very slender strips: the angle between neighbours is 0.1°, its sagitta well above the resolution.
    let mut mesh = sonel_geometry::Mesh::default();
    let at = |i: u32, z: f64| {
        let angle = f64::from(i) * 0.1f64.to_radians();
        dvec3(5.0 * angle.cos(), 5.0 * angle.sin(), z)
    };
    for i in 0..900 {
        rooms::add_quad(&mut mesh, 0, [at(i, 0.0), at(i + 1, 0.0), at(i + 1, 3.0), at(i, 3.0)]);
    }
    assert_eq!(Geometry::build(mesh).unwrap().surfaces().len(), 900);
}

#[test]
fn coplanar_surfaces_share_a_plane_whatever_else_they_are() {
    let mut mesh = rooms::shoebox();
    let square =
        |x: f64| [dvec3(x, 1.0, 1.0), dvec3(x + 1.0, 1.0, 1.0), dvec3(x + 1.0, 2.0, 1.0), dvec3(x, 2.0, 1.0)];
    let turned_over = |[a, b, c, d]: [DVec3; 4]| [d, c, b, a];
    rooms::add_quad(&mut mesh, 7, square(1.0));
    rooms::add_quad(&mut mesh, 8, turned_over(square(4.0)));
    rooms::add_quad(&mut mesh, 9, square(6.0).map(|v| v + 0.01 * DVec3::Z));
    for mesh in [mesh.clone(), rooms::turned(mesh, dvec3(1e4, 0.0, 0.0))] {
        let geometry = Geometry::build(mesh).unwrap();
        let plane =
            |material: u32| geometry.surfaces().iter().find(|s| s.material == material).unwrap().plane;
        assert_eq!(plane(7), plane(8));
        assert_ne!(plane(9), plane(8));
        let planes: HashSet<_> = geometry.surfaces().iter().map(|s| s.plane).collect();
        assert_eq!((geometry.surfaces().len(), planes.len()), (9, 8));
    }
}

#[test]
fn materials_and_gaps_divide_a_plane_into_surfaces() {
    let mut mesh = rooms::tessellated_box(dvec3(4.0, 4.0, 4.0), 4);
    // A checked floor: quads of two materials touch those of their own only at corners.
    for (index, triangle) in mesh.triangles.iter_mut().enumerate().filter(|(_, t)| t.material == 4) {
        let quad = index / 2;
        triangle.material = 10 + ((quad / 4 + quad % 4) % 2) as u32;
    }
    let geometry = Geometry::build(mesh).unwrap();
    assert_eq!(geometry.surfaces().len(), 5 + 16);
    assert!(geometry.as_shoebox().is_none());
}
