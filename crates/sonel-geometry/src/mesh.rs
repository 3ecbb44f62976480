//! Triangle meshes as they come from a file: any units are metres, any orientation, nothing shared.

use glam::{DVec3, dvec3};

/// Triangles over a list of vertices, each with the material of its surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions [m].
    pub vertices: Vec<DVec3>,
    /// Triangles over these vertices.
    pub triangles: Vec<MeshTriangle>,
}

/// One triangle of a [`Mesh`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshTriangle {
    /// Indices of its corners; the normal points to where they appear counter-clockwise.
    pub corners: [u32; 3],
    /// Index into the scene's list of materials.
    pub material: u32,
}

impl MeshTriangle {
    /// The ends of its sides, the lower index first.
    pub(crate) fn sides(&self) -> [[u32; 2]; 3] {
        sides(self.corners).map(|[from, to]| [from.min(to), from.max(to)])
    }
}

/// The sides of a triangle, by their ends in its order.
pub(crate) fn sides<T: Copy>([a, b, c]: [T; 3]) -> [[T; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

impl Mesh {
    /// A rectangular room of the given inner size [m], one corner at the origin, with one material for each wall in
    /// the order x = 0, x = size, y = 0, y = size, z = 0, z = size. The normals point into the room.
    pub fn shoebox(size: [f64; 3], materials: [u32; 6]) -> Self {
        let vertices = (0..8u32)
            .map(|i| {
                let coordinate = |axis: u32| if i >> axis & 1 == 1 { size[axis as usize] } else { 0.0 };
                dvec3(coordinate(0), coordinate(1), coordinate(2))
            })
            .collect();
        // Corner i has bit 0, 1, 2 set where x, y, z are at their far wall.
        let walls: [[u32; 4]; 6] =
            [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
        let triangles = walls
            .iter()
            .zip(materials)
            .flat_map(|(&[a, b, c, d], material)| {
                [[a, b, c], [a, c, d]].map(|corners| MeshTriangle { corners, material })
            })
            .collect();
        Self { vertices, triangles }
    }

    /// The positions of one triangle's corners [m].
    #[must_use]
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].corners.map(|corner| self.vertices[corner as usize])
    }

    /// Vector area of one triangle [m²]: along its normal, as long as its area.
    #[must_use]
    pub fn vector_area(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a)
    }

    /// Unit normal of a side of a triangle; 2 t is the front of triangle t, 2 t + 1 its back.
    pub(crate) fn outward(&self, side: u32) -> DVec3 {
        self.vector_area(side / 2).normalize_or_zero() * if side.is_multiple_of(2) { 1.0 } else { -1.0 }
    }

    /// Lower and upper corner of the box around all triangles [m]; inverted when there are none.
    pub(crate) fn bounds(&self) -> (DVec3, DVec3) {
        bounds_of_points(self.triangles.iter().flat_map(|t| t.corners).map(|c| self.vertices[c as usize]))
    }

    /// Lower and upper corner of the box around some triangles [m].
    pub fn bounds_of(&self, triangles: &[u32]) -> (DVec3, DVec3) {
        bounds_of_points(triangles.iter().flat_map(|&triangle| self.corners(triangle)))
    }
}

pub(crate) fn bounds_of_points(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shoebox_normals_point_into_the_room() {
        let mesh = Mesh::shoebox([2.0, 3.0, 4.0], [0, 1, 2, 3, 4, 5]);
        let middle = dvec3(1.0, 1.5, 2.0);
        assert_eq!(mesh.triangles.len(), 12);
        for i in 0..12 {
            let normal = mesh.vector_area(i);
            assert!(normal.dot(middle - mesh.corners(i)[0]) > 0.0, "triangle {i}");
            let axis = mesh.triangles[i as usize].material as usize / 2;
            let far = mesh.triangles[i as usize].material % 2 == 1;
            assert!(if far { normal[axis] < 0.0 } else { normal[axis] > 0.0 }, "triangle {i}");
        }
    }
}
