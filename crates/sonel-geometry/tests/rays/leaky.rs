//! The known-wrong triangle test that the tests of watertightness must convict: Möller–Trumbore in `f32`, strict.

use glam::Vec3;
use sonel_geometry::Geometry;

/// The nearest triangle in front of the origin.
pub(crate) fn closest(geometry: &Geometry, origin: Vec3, direction: Vec3) -> Option<u32> {
    let mesh = geometry.mesh();
    let hits = mesh.triangles.iter().enumerate().filter_map(|(index, triangle)| {
        let corners = triangle.corners.map(|corner| geometry.to_local(mesh.vertices[corner as usize]));
        Some((moeller_trumbore(corners, origin, direction)?, index as u32))
    });
    hits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, triangle)| triangle)
}

fn moeller_trumbore([a, b, c]: [Vec3; 3], origin: Vec3, direction: Vec3) -> Option<f32> {
    let (ab, ac) = (b - a, c - a);
    let across = direction.cross(ac);
    let inverse = 1.0 / ab.dot(across);
    let from = origin - a;
    let u = from.dot(across) * inverse;
    let turned = from.cross(ab);
    let v = direction.dot(turned) * inverse;
    let distance = ac.dot(turned) * inverse;
    (u > 0.0 && v > 0.0 && u + v < 1.0 && distance > 0.0).then_some(distance)
}
