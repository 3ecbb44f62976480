//! Faces that cross one another.
//!
//! Two triangles cross where each has corners on both sides of the other's plane, farther away than the scene's resolution, and
//! the parts of the line of both planes that lie in them overlap by more than that. Faces that touch, meet at an edge or lie in
//! one plane do not cross.
//!
//! Reference: [Moeller1997] (docs/references.md).

use crate::Geometry;
use glam::DVec3;

/// Two triangles that cross.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Their indices in [`Geometry::mesh`], the lower first.
    pub triangles: [u32; 2],
    /// The ends of the line in which they cross, in world coordinates [m].
    pub ends: [DVec3; 2],
}

impl Geometry {
    /// All pairs of triangles that cross, in the order of the mesh.
    pub fn crossings(&self) -> Vec<Crossing> {
        let tolerance = f64::from(self.resolution());
        let mut found = Vec::new();
        for first in 0..self.mesh().triangles.len() as u32 {
            self.visit_near(first, 0.0, |second| {
                let corners = |triangle| self.mesh().corners(triangle);
                if first < second
                    && let Some(ends) = crossing(corners(first), corners(second), tolerance)
                {
                    found.push(Crossing { triangles: [first, second], ends });
                }
            });
        }
        found.sort_by_key(|crossing| crossing.triangles);
        found
    }
}

/// The line in which two triangles cross by more than `tolerance` [m].
fn crossing(a: [DVec3; 3], b: [DVec3; 3], tolerance: f64) -> Option<[DVec3; 2]> {
    let normal = |[p, q, r]: [DVec3; 3]| (q - p).cross(r - p).try_normalize();
    let (normal_a, normal_b) = (normal(a)?, normal(b)?);
    let cut_a = cut(a, b[0], normal_b, tolerance)?;
    let cut_b = cut(b, a[0], normal_a, tolerance)?;
    let along = normal_a.cross(normal_b).try_normalize()?;
    let sorted = |[p, q]: [DVec3; 2]| if p.dot(along) <= q.dot(along) { [p, q] } else { [q, p] };
    let ([a_from, a_to], [b_from, b_to]) = (sorted(cut_a), sorted(cut_b));
    let from = if a_from.dot(along) >= b_from.dot(along) { a_from } else { b_from };
    let to = if a_to.dot(along) <= b_to.dot(along) { a_to } else { b_to };
    ((to - from).dot(along) > tolerance).then_some([from, to])
}

/// Where a triangle with corners on both sides of a plane cuts it.
fn cut(corners: [DVec3; 3], point: DVec3, normal: DVec3, tolerance: f64) -> Option<[DVec3; 2]> {
    let heights = corners.map(|corner| normal.dot(corner - point));
    let (low, high) = (heights.into_iter().fold(0.0, f64::min), heights.into_iter().fold(0.0, f64::max));
    if low > -tolerance || high < tolerance {
        return None;
    }
    let mut ends = [0, 1, 2].into_iter().filter_map(|i| {
        let (here, there) = (heights[i], heights[(i + 1) % 3]);
        ((here < 0.0) != (there < 0.0)).then(|| corners[i].lerp(corners[(i + 1) % 3], here / (here - there)))
    });
    Some([ends.next()?, ends.next()?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mesh, MeshTriangle};
    use glam::dvec3;

    /// A box of 10 × 7 × 3 m with a screen of 2 × 2 m that stands at `x` and begins `z` above the floor.
    fn with_screen(x: f64, z: f64) -> Geometry {
        let mut mesh = Mesh::shoebox([10.0, 7.0, 3.0], [0; 6]);
        let first = mesh.vertices.len() as u32;
        mesh.vertices
            .extend([(2.0, z), (4.0, z), (4.0, z + 2.0), (2.0, z + 2.0)].map(|(y, z)| dvec3(x, y, z)));
        for corners in [[0, 1, 2], [0, 2, 3]] {
            mesh.triangles.push(MeshTriangle { corners: corners.map(|corner| first + corner), material: 0 });
        }
        Geometry::build(mesh).unwrap()
    }

    #[test]
    fn what_stands_or_hangs_does_not_cross() {
        for z in [0.0, 0.5, 1.0] {
            assert_eq!(with_screen(5.0, z).crossings(), []);
        }
    }

    #[test]
    fn what_goes_through_a_wall_crosses_it() {
        let crossings = with_screen(5.5, -0.5).crossings();
        assert!(!crossings.is_empty());
        let length: f64 = crossings.iter().map(|crossing| crossing.ends[0].distance(crossing.ends[1])).sum();
        assert!((length - 2.0).abs() < 1e-9, "{length}");
        for crossing in &crossings {
            assert!(crossing.ends.iter().all(|end| end.z.abs() < 1e-9 && (end.x - 5.5).abs() < 1e-9));
        }
    }

    /// Every pair of many random triangles, judged one by one.
    #[test]
    fn the_index_finds_what_comparing_all_pairs_finds() {
        let mut state = 7u64;
        let mut number = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1u32 << 24)
        };
        let mut mesh = Mesh::default();
        for i in 0..300u32 {
            let center = 4.0 * dvec3(number(), number(), number());
            for _ in 0..3 {
                mesh.vertices.push(center + dvec3(number(), number(), number()));
            }
            mesh.triangles.push(MeshTriangle { corners: [3 * i, 3 * i + 1, 3 * i + 2], material: 0 });
        }
        let geometry = Geometry::build(mesh).unwrap();
        let found: Vec<[u32; 2]> = geometry.crossings().iter().map(|crossing| crossing.triangles).collect();
        let mesh = geometry.mesh();
        let count = mesh.triangles.len() as u32;
        let tolerance = f64::from(geometry.resolution());
        let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
        let all: Vec<[u32; 2]> = pairs
            .filter(|[a, b]| crossing(mesh.corners(*a), mesh.corners(*b), tolerance).is_some())
            .collect();
        assert!(all.len() > 10, "{}", all.len());
        assert_eq!(found, all);
    }
}
