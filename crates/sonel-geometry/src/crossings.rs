//! Faces that cross one another as they were drawn.

use glam::DVec3;

/// A line in which two triangles of the mesh crossed: each had corners on both sides of the other. They are divided there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The ends of the line, in world coordinates [m].
    pub ends: [DVec3; 2],
}

#[cfg(test)]
mod tests {
    use crate::{Geometry, Mesh, MeshTriangle};
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
        let geometry = with_screen(5.5, -0.5);
        let length: f64 = geometry.crossings().iter().map(|it| it.ends[0].distance(it.ends[1])).sum();
        assert!((length - 2.0).abs() < 1e-9, "{length}");
        for crossing in geometry.crossings() {
            assert!(crossing.ends.iter().all(|end| end.z.abs() < 1e-9 && (end.x - 5.5).abs() < 1e-9));
        }
    }
}
