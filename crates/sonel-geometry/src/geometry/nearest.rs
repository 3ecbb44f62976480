//! The nearest point of all surfaces, by best-first search in the tree of triangles.

use glam::DVec3;

use super::Geometry;
use crate::enclosure::closest_on_triangle;

impl Geometry {
    /// Distance from a world position to the nearest point of any surface [m].
    pub fn distance_to_nearest_surface(&self, point: DVec3) -> f64 {
        self.closest_point(point).1.distance(point)
    }

    /// Distance from a world position to the nearest surface [m], and its material.
    pub fn nearest_surface(&self, point: DVec3) -> (f64, u32) {
        let (triangle, closest) = self.closest_point(point);
        (closest.distance(point), self.surface(self.triangle_surface(triangle)).material)
    }

    /// The point of any triangle nearest to a world position [m], and that triangle.
    pub(crate) fn closest_point(&self, point: DVec3) -> (u32, DVec3) {
        // A start, as boxes are at no distance from a point beyond single precision.
        let start = closest_on_triangle(self.mesh.corners(0), point);
        let mut closest = (start.distance(point), 0, start);
        // Boxes are padded by more than the rounding of local positions.
        self.index.around(self.to_local(point), |triangle| {
            let on_triangle = closest_on_triangle(self.mesh.corners(triangle), point);
            let distance = on_triangle.distance(point);
            if (distance, triangle) < (closest.0, closest.1) {
                closest = (distance, triangle, on_triangle);
            }
            closest.0
        });
        (closest.1, closest.2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use glam::dvec3;

    /// The nearest point of all triangles, by the search through the tree and by looking at each: about a heap of random triangles, small
    /// and large, near and a thousand extents away.
    #[test]
    fn the_nearest_point_is_that_of_a_full_scan() {
        // Quasi-random: multiples of three irrational numbers fill a cube evenly.
        let mut count = 0.0;
        let mut within = |extent: f64| {
            count += 1.0;
            (dvec3(0.819_172_513, 0.671_043_607, 0.549_700_478) * count).fract() * 2.0 * extent - extent
        };
        let mut mesh = Mesh { vertices: Vec::new(), triangles: Vec::new() };
        for number in 0..400_u32 {
            let (place, size) = (within(5.0), if number % 10 == 0 { 3.0 } else { 0.2 });
            mesh.vertices.extend([place, place + within(size), place + within(size)]);
            mesh.triangles.push(crate::MeshTriangle {
                corners: [0, 1, 2].map(|corner| 3 * number + corner),
                material: 0,
            });
        }
        let geometry = Geometry::build(mesh).unwrap();
        let triangles = geometry.mesh.triangles.len() as u32;
        for reach in [0.5, 5.0, 50.0, 5000.0] {
            for _ in 0..100 {
                let point = within(reach);
                let distance =
                    |triangle| closest_on_triangle(geometry.mesh.corners(triangle), point).distance(point);
                let all = || (0..triangles).map(|triangle| (distance(triangle), triangle));
                let least = |a: (f64, u32), b: (f64, u32)| if b < a { b } else { a };
                let (nearest, triangle) = all().reduce(least).unwrap();
                let (found, place) = geometry.closest_point(point);
                assert_eq!((place.distance(point), found), (nearest, triangle), "{point}");
            }
        }
    }
}
