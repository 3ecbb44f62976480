//! How far hits keep from the rim of their triangle.
//!
//! A position on a wall is lifted before a ray leaves it. Near a corner of angle φ the lifted origin must also be on
//! the right side of the other wall: at a distance of lift · cot(φ/2) from the corner it is one lift away from both.
//! The most acute corner at any of a triangle's vertices decides for the whole triangle, since walls also meet a
//! triangle in a vertex alone.

use crate::topology::SharedEdge;
use crate::{Mesh, PlaneId};
use glam::DVec3;

/// The margin in each barycentric coordinate of a triangle: its share of each height.
pub(crate) type Rim = [f32; 3];

/// The rim of each triangle, for a given lift [m].
pub(crate) fn rims(mesh: &Mesh, edges: &[SharedEdge], planes: &[PlaneId], lift: f64) -> Vec<Rim> {
    let margins = margins(mesh, edges, planes, lift);
    let rim = |(triangle, margin): (usize, f64)| {
        let [a, b, c] = mesh.corners(triangle as u32);
        let double_area = (b - a).cross(c - a).length();
        [c - b, a - c, b - a].map(|side| (margin * side.length() / double_area) as f32)
    };
    margins.into_iter().enumerate().map(rim).collect()
}

/// For each triangle the distance [m] from its sides within which no hit is placed.
fn margins(mesh: &Mesh, edges: &[SharedEdge], planes: &[PlaneId], lift: f64) -> Vec<f64> {
    // At a free edge and at a flat seam one lift keeps rounding from leaving the triangle.
    let mut at_vertex = vec![lift; mesh.vertices.len()];
    for edge in edges {
        let margin = lift * cotangent_of_half_angle(mesh, edge, planes);
        for end in edge.ends {
            at_vertex[end as usize] = at_vertex[end as usize].max(margin);
        }
    }
    let margin = |corners: [u32; 3]| corners.map(|c| at_vertex[c as usize]).into_iter().fold(lift, f64::max);
    mesh.triangles.iter().map(|triangle| margin(triangle.corners)).collect()
}

/// cot(φ/2) of the most acute corner φ between two faces of an edge that are not in one plane.
fn cotangent_of_half_angle(mesh: &Mesh, edge: &SharedEdge, planes: &[PlaneId]) -> f64 {
    let mut largest: f64 = 0.0;
    for (i, &a) in edge.faces.iter().enumerate() {
        for &b in &edge.faces[i + 1..] {
            if planes[a as usize] != planes[b as usize] {
                let cosine = edge.inward(mesh, a).dot(edge.inward(mesh, b));
                largest = largest.max(((1.0 + cosine) / (1.0 - cosine)).max(0.0).sqrt());
            }
        }
    }
    largest
}

/// Position off the rim for a point on the rim of a triangle; the centre of the inscribed circle where the rim is all there is. [`None`] for
/// a point that is not on the rim.
#[inline]
pub(crate) fn keep_inside([a, b, c]: [DVec3; 3], point: DVec3, rim: Rim) -> Option<DVec3> {
    let normal = (b - a).cross(c - a);
    let per_area = 1.0 / normal.length_squared();
    let weight = |p: DVec3, q: DVec3| normal.dot((q - p).cross(point - p)) * per_area;
    let weights = [weight(b, c), weight(c, a), weight(a, b)];
    let taken = rim.map(f64::from);
    let spare: [f64; 3] = std::array::from_fn(|i| weights[i] - taken[i]);
    if spare.iter().all(|&spare| spare >= 0.0) {
        return None;
    }
    let free = 1.0 - taken.iter().sum::<f64>();
    let share = if free > 0.0 {
        let spare = spare.map(|spare| spare.max(0.0));
        let sum = spare.iter().sum::<f64>();
        std::array::from_fn(|i| taken[i] + free * spare[i] / sum)
    } else {
        // The rim is proportional to the sides, and so are the coordinates of the inscribed circle's centre.
        taken.map(|taken| taken / (1.0 - free))
    };
    let inside = a * share[0] + b * share[1] + c * share[2];
    // A triangle lower than rounding has no inside.
    Some(if inside.is_finite() { inside } else { (a + b + c) / 3.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::shared_edges;
    use glam::dvec3;

    #[test]
    fn a_triangle_without_an_inside_is_hit_in_its_middle() {
        for height in [0.0, 1e-170] {
            let corners = [dvec3(0.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.0), dvec3(2.0, height, 0.0)];
            for rim in [[f32::INFINITY; 3], [0.1; 3]] {
                let kept = keep_inside(corners, dvec3(0.5, 0.0, 0.0), rim);
                assert_eq!(kept, Some(dvec3(1.0, height / 3.0, 0.0)), "{height}, {rim:?}");
            }
        }
    }

    #[test]
    fn points_keep_their_margin_and_else_stay_where_they_are() {
        let corners = [dvec3(0.0, 0.0, 0.0), dvec3(4.0, 0.0, 0.0), dvec3(0.0, 3.0, 0.0)];
        let inner = dvec3(1.0, 1.0, 0.0);
        // Sides of 5, 3 and 4 opposite the corners, twice the area is 12.
        let rim = |margin: f32| [5.0, 3.0, 4.0].map(|side| margin * side / 12.0);
        assert!(keep_inside(corners, inner, rim(0.1)).is_none());
        for outer in
            [dvec3(1.0, -1e-7, 0.0), dvec3(0.0, 0.0, 0.0), dvec3(4.0, 0.0, 0.0), dvec3(2.0, 1.5, 0.0)]
        {
            let kept = keep_inside(corners, outer, rim(0.1)).unwrap();
            let heights = [kept.y, kept.x, (12.0 - 3.0 * kept.x - 4.0 * kept.y) / 5.0];
            assert!(heights.iter().all(|&h| h > 0.1 - 1e-7), "{heights:?}");
            assert!(kept.distance(outer) < 1.0);
        }
        // The inscribed circle has radius 1: no room for a margin of 2.
        assert!(keep_inside(corners, inner, rim(2.0)).unwrap().distance(inner) < 1e-7);
    }

    #[test]
    fn an_acute_corner_widens_the_margin() {
        let margin_at = |degrees: f64| {
            let angle = degrees.to_radians();
            let vertices =
                vec![DVec3::ZERO, DVec3::Z, dvec3(1.0, 0.0, 0.0), dvec3(angle.cos(), angle.sin(), 0.0)];
            let triangle = |corners| crate::MeshTriangle { corners, material: 0 };
            let mesh = Mesh { vertices, triangles: vec![triangle([0, 1, 2]), triangle([1, 0, 3])] };
            margins(&mesh, &shared_edges(&mesh), &[PlaneId(0), PlaneId(1)], 1.0)
        };
        assert_eq!(margin_at(135.0), [1.0, 1.0]);
        let five = 1.0 / 2.5f64.to_radians().tan();
        assert!((margin_at(5.0)[0] - five).abs() < 1e-9 * five);
    }
}
