//! What a closed shell encloses: volume by the divergence theorem, inside by the winding number.
//!
//! The winding number is the sum of the solid angles of the triangles over 4π, each by the formula of
//! [VanOosterom1983], in `f64`: it needs no ray and so has no unlucky direction.

use crate::Mesh;
use crate::mesh::sides;
use glam::DVec3;
use std::f64::consts::PI;

/// Signed volume enclosed by some sides of triangles [m³], positive where they face outward; 2 t is the front of triangle t, 2 t + 1 its back.
pub(crate) fn signed_volume(mesh: &Mesh, sides: &[u32]) -> f64 {
    // Relative to one of the corners, so that a scene far from the origin loses no digits.
    let Some(&first) = sides.first() else { return 0.0 };
    let origin = mesh.corners(first / 2)[0];
    let sixfold: f64 = sides
        .iter()
        .map(|&side| {
            let [a, b, c] = mesh.corners(side / 2).map(|v| v - origin);
            let part = a.dot(b.cross(c));
            if side % 2 == 0 { part } else { -part }
        })
        .sum();
    sixfold / 6.0
}

/// Winding number of some sides around a point: ±1 inside a closed shell, 0 outside, about ±½ on a face.
pub(crate) fn winding_number(mesh: &Mesh, sides: &[u32], point: DVec3) -> f64 {
    let angle = |side: &u32| {
        let angle = solid_angle(mesh.corners(side / 2), point);
        if side.is_multiple_of(2) { angle } else { -angle }
    };
    sides.iter().map(angle).sum::<f64>() / (4.0 * PI)
}

/// Share of the product of three lengths below which their volume is rounding, so that they lie in a plane: some hundred times the 1e-15 of
/// twelve products and sums in double precision.
const FLAT: f64 = 1e-13;

/// Signed solid angle of a triangle seen from a point [sr]; 0 from its plane, where rounding would tell between ±2π on the triangle.
fn solid_angle(corners: [DVec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = corners.map(|v| v - point);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let volume = a.dot(b.cross(c));
    let rest = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    if volume.abs() <= FLAT * la * lb * lc { 0.0 } else { 2.0 * libm::atan2(volume, rest) }
}

/// Distance along a unit direction at which a triangle is met, its rim included; [`None`] where it is not [m].
pub(crate) fn distance_along(corners: [DVec3; 3], from: DVec3, direction: DVec3) -> Option<f64> {
    let [a, b, c] = corners.map(|corner| corner - from);
    let parts = [b.cross(c), c.cross(a), a.cross(b)].map(|part| part.dot(direction));
    let is_met = parts.iter().all(|&part| part >= 0.0) || parts.iter().all(|&part| part <= 0.0);
    let normal = (b - a).cross(c - a);
    let distance = normal.dot(a) / normal.dot(direction);
    (is_met && distance > 0.0 && distance.is_finite()).then_some(distance)
}

/// The point of a triangle nearest to a point.
pub(crate) fn closest_on_triangle(corners: [DVec3; 3], point: DVec3) -> DVec3 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let inside = |p: DVec3, q: DVec3| normal.dot((q - p).cross(point - p)) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) {
        return point - normal.dot(point - a) / normal.length_squared() * normal;
    }
    sides(corners)
        .into_iter()
        .map(|[p, q]| closest_on_segment(p, q, point))
        .min_by(|p, q| p.distance_squared(point).total_cmp(&q.distance_squared(point)))
        .expect("a triangle has sides")
}

/// The point of a segment, or of a single point, nearest to a point.
pub(crate) fn closest_on_segment(from: DVec3, to: DVec3, point: DVec3) -> DVec3 {
    let along = to - from;
    let share = ((point - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    from + share * along
}
