//! The area of a disc clipped to a planar surface.
//!
//! With the centre on the surface, the area is that of the whole disc plus, for every edge of the surface's boundary that
//! enters it, the triangle over the chord minus the sector over the same angle. Edges further away change nothing,
//! so the cost is that of finding near edges, whatever the shape: holes and notches come out right by orientation.

use glam::{DVec2, DVec3};
use sonel_geometry::{Geometry, Surface};
use std::collections::HashSet;

/// A surface laid out in its plane.
#[derive(Debug, Clone)]
pub struct Sheet {
    origin: DVec3,
    across: DVec3,
    along: DVec3,
    /// Boundary edges with the surface on their left, seen from the front.
    boundary: Vec<(DVec2, DVec2)>,
}

impl Sheet {
    /// Lays out `surface`. Coordinates are about the scene's centre.
    #[must_use]
    pub fn new(geometry: &Geometry, surface: &Surface) -> Self {
        let across = surface.normal.any_orthonormal_vector();
        let along = surface.normal.cross(across);
        let mut sheet =
            Self { origin: surface.centroid - geometry.center(), across, along, boundary: Vec::new() };
        let triangles = || surface.triangles.iter().map(|&t| geometry.mesh().triangles[t as usize].corners);
        let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
        let directed: HashSet<(u32, u32)> = triangles().flat_map(edges).collect();
        let corner = |index: u32| geometry.mesh().vertices[index as usize] - geometry.center();
        sheet.boundary = triangles()
            .flat_map(edges)
            .filter(|&(from, to)| !directed.contains(&(to, from)))
            .map(|(from, to)| (sheet.flat(corner(from)), sheet.flat(corner(to))))
            .collect();
        sheet
    }

    /// Coordinates in the plane of a point on it [m].
    #[inline]
    #[must_use]
    pub fn flat(&self, point: DVec3) -> DVec2 {
        let offset = point - self.origin;
        DVec2::new(self.across.dot(offset), self.along.dot(offset))
    }

    /// Area of the disc of `radius` about `centre`, a point of the surface, that lies on the surface [m²].
    #[must_use]
    pub fn clipped_area(&self, centre: DVec2, radius: f64) -> f64 {
        let whole = core::f64::consts::PI * radius * radius;
        let change: f64 =
            self.boundary.iter().map(|&(a, b)| edge_change(a - centre, b - centre, radius)).sum();
        // A centre within rounding of the boundary can miss a sliver; no disc is emptier than a corner's.
        (whole + change).clamp(whole * SMALLEST_SHARE, whole)
    }
}

/// Smallest share of a disc that is believed: that of a corner of a third of a degree.
const SMALLEST_SHARE: f64 = 1e-3;

/// By how much the edge from `a` to `b`, seen from the disc's centre, changes the area of the disc.
fn edge_change(a: DVec2, b: DVec2, radius: f64) -> f64 {
    let direction = b - a;
    let (square, half_linear) = (direction.length_squared(), a.dot(direction));
    let discriminant = half_linear * half_linear - square * (a.length_squared() - radius * radius);
    if discriminant <= 0.0 || square <= 0.0 {
        return 0.0;
    }
    let root = discriminant.sqrt();
    let enters = ((-half_linear - root) / square).max(0.0);
    let leaves = ((-half_linear + root) / square).min(1.0);
    if enters >= leaves {
        return 0.0;
    }
    let (from, to) = (a + direction * enters, a + direction * leaves);
    0.5 * (from.perp_dot(to) - radius * radius * libm::atan2(from.perp_dot(to), from.dot(to)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;
    use sonel_geometry::Mesh;

    fn floor(size: [f64; 3]) -> (Geometry, Sheet) {
        let geometry = Geometry::build(Mesh::shoebox(size, [0; 6])).unwrap();
        let surface = geometry.surfaces().iter().find(|surface| surface.normal.z > 0.9).unwrap().clone();
        let sheet = Sheet::new(&geometry, &surface);
        (geometry, sheet)
    }

    fn area(size: [f64; 3], at: [f64; 2], radius: f64) -> f64 {
        let (geometry, sheet) = floor(size);
        sheet.clipped_area(sheet.flat(DVec3::new(at[0], at[1], 0.0) - geometry.center()), radius)
    }

    #[test]
    fn discs_inside_at_edges_and_in_corners_have_their_exact_areas() {
        let size = [10.0, 8.0, 5.0];
        let close =
            |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        close(area(size, [5.0, 4.0], 1.0), PI);
        close(area(size, [1e-12, 4.0], 1.0), PI / 2.0);
        close(area(size, [1e-12, 1e-12], 1.0), PI / 4.0);
        // Half a radius from a wall: the disc less a segment of 120°.
        close(area(size, [0.5, 4.0], 1.0), PI - (PI / 3.0 - 3.0_f64.sqrt() / 4.0));
        close(area(size, [5.0, 4.0], 100.0), PI * 1e4 * SMALLEST_SHARE.max(80.0 / (PI * 1e4)));
    }

    #[test]
    fn the_area_agrees_with_counting_points() {
        let (size, at, radius) = ([3.0, 2.0, 2.0], [0.4, 1.7], 1.1);
        let (cells, mut inside) = (2000, 0);
        for i in 0..cells {
            for j in 0..cells {
                let (x, y) = (3.0 * (f64::from(i) + 0.5) / 2000.0, 2.0 * (f64::from(j) + 0.5) / 2000.0);
                inside += u32::from((x - at[0]).powi(2) + (y - at[1]).powi(2) < radius * radius);
            }
        }
        let counted = f64::from(inside) * 6.0 / 4e6;
        let exact = area(size, at, radius);
        assert!((exact / counted - 1.0).abs() < 1e-3);
        assert!((PI * radius * radius / counted - 1.0).abs() > 0.3, "the unclipped disc is rejected");
    }
}
