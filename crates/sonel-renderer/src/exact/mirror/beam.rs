//! Beams: the region that an image source can reach through its reflecting surfaces.
//!
//! The beam of an image is the cone from the image through the part of the last mirror that the beam before it lights.
//! Apertures are taken convex (the convex hull of a surface that is not) and every test has an outward tolerance, so a beam
//! is never smaller than the true one: what it leaves out can carry nothing.
//!
//! Reference: [HeckbertHanrahan1984] (docs/references.md).

use std::f64::consts::TAU;

use glam::DVec3;

/// An edge seen under a smaller angle [rad] has no plane worth the name: clipping leaves such edges behind, and the
/// rounding of their ends would turn them anywhere. Without its plane a beam is only larger.
const SMALLEST_SINE: f64 = 1e-6;

/// Apertures of more corners are replaced by a circumscribed polygon: clipping takes the product of both numbers of corners.
const MOST_CORNERS: usize = 64;

/// An image and what is seen of it through an aperture.
#[derive(Debug, Clone)]
pub(crate) struct Beam {
    /// The image [m].
    pub apex: DVec3,
    /// Inward unit normals of the planes through the apex and the aperture's edges.
    sides: Vec<DVec3>,
}

impl Beam {
    /// The beam from `apex` through the convex polygon `aperture`, which does not lie in one plane with it.
    #[must_use]
    pub(crate) fn new(apex: DVec3, aperture: &[DVec3]) -> Self {
        let centre = aperture.iter().sum::<DVec3>() / aperture.len() as f64 - apex;
        let sides = (0..aperture.len())
            .filter_map(|at| {
                let (a, b) = (aperture[at] - apex, aperture[(at + 1) % aperture.len()] - apex);
                let normal = a.cross(b);
                if normal.length() <= SMALLEST_SINE * a.length() * b.length() {
                    return None;
                }
                let normal = normal.normalize();
                Some(if normal.dot(centre) < 0.0 { -normal } else { normal })
            })
            .collect();
        Self { apex, sides }
    }

    /// Inward unit normals of the planes that bound the beam; all contain the apex.
    #[must_use]
    pub(crate) fn sides(&self) -> &[DVec3] {
        &self.sides
    }

    /// Whether a ball lies wholly outside one side.
    #[must_use]
    pub(crate) fn misses(&self, centre: DVec3, radius: f64) -> bool {
        self.sides.iter().any(|side| side.dot(centre - self.apex) < -radius)
    }

    /// Leaves the part of a convex `polygon` inside the beam, `tolerance` [m] generous.
    pub(crate) fn clip(&self, polygon: &mut Polygon, tolerance: f64) {
        for side in &self.sides {
            polygon.clip(|point| side.dot(point - self.apex) + tolerance);
        }
    }
}

/// A convex polygon that is cut again and again; its memory is kept.
#[derive(Debug, Default)]
pub(crate) struct Polygon {
    /// In order; none where nothing is left.
    pub corners: Vec<DVec3>,
    heights: Vec<f64>,
    kept: Vec<DVec3>,
}

impl Polygon {
    /// Begins anew with these corners.
    pub(crate) fn set(&mut self, corners: &[DVec3]) {
        self.corners.clear();
        self.corners.extend_from_slice(corners);
    }

    /// Leaves the part where `height`, linear in the point, is not negative.
    ///
    /// Reference: [SutherlandHodgman1974] (docs/references.md).
    pub(crate) fn clip(&mut self, height: impl Fn(DVec3) -> f64) {
        self.heights.clear();
        self.heights.extend(self.corners.iter().map(|&corner| height(corner)));
        if self.heights.iter().all(|&height| height >= 0.0) {
            return;
        }
        self.kept.clear();
        for (at, &corner) in self.corners.iter().enumerate() {
            let following = (at + 1) % self.corners.len();
            let (here, there) = (self.heights[at], self.heights[following]);
            if here >= 0.0 {
                self.kept.push(corner);
            }
            if (here >= 0.0) != (there >= 0.0) {
                self.kept.push(corner + (self.corners[following] - corner) * (here / (here - there)));
            }
        }
        if self.kept.len() < 3 {
            self.kept.clear();
        }
        std::mem::swap(&mut self.corners, &mut self.kept);
    }
}

/// Convex hull of points in a plane with unit `normal`, in order about it.
///
/// Points are sorted along a direction that no side of a drawing is at right angles to: of equal ones rounding would decide which are
/// corners.
#[must_use]
pub(crate) fn hull(points: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    let (first, second) = normal.any_orthonormal_pair();
    let across = 0.853_149_270_118_41 * first + 0.521_672_413_307_59 * second;
    let along = normal.cross(across);
    let mut flat: Vec<(f64, f64, DVec3)> = points.iter().map(|&p| (across.dot(p), along.dot(p), p)).collect();
    flat.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let turn = |a: &(f64, f64, DVec3), b: &(f64, f64, DVec3), c: &(f64, f64, DVec3)| {
        (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
    };
    let chain = |points: &mut dyn Iterator<Item = &(f64, f64, DVec3)>| {
        let mut chain: Vec<(f64, f64, DVec3)> = Vec::new();
        for &point in points {
            while chain.len() > 1 && turn(&chain[chain.len() - 2], &chain[chain.len() - 1], &point) <= 0.0 {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let lower = chain(&mut flat.iter());
    let upper = chain(&mut flat.iter().rev());
    lower.into_iter().chain(upper).map(|(_, _, point)| point).collect()
}

/// The convex hull of points in a plane with unit `normal`; where it has more than [`MOST_CORNERS`] corners, a polygon of so many about it,
/// whose sides touch it.
#[must_use]
pub(crate) fn outline(points: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    let hull = hull(points, normal);
    if hull.len() <= MOST_CORNERS {
        return hull;
    }
    let (first, second) = normal.any_orthonormal_pair();
    let step = TAU / MOST_CORNERS as f64;
    let outward = |side: usize| {
        let (sine, cosine) = libm::sincos(step * side as f64);
        cosine * first + sine * second
    };
    let origin = hull[0];
    let reach = |side: usize| {
        hull.iter().map(|corner| outward(side).dot(*corner - origin)).fold(f64::NEG_INFINITY, f64::max)
    };
    let reaches: Vec<f64> = (0..MOST_CORNERS).map(reach).collect();
    // The corner between a side and the next one, by the distances of both from the origin.
    let corner = |side: usize| {
        let (here, there) = (reaches[side], reaches[(side + 1) % MOST_CORNERS]);
        let along = (there - here * libm::cos(step)) / libm::sin(step);
        origin + here * outward(side) + along * normal.cross(outward(side))
    };
    (0..MOST_CORNERS).map(corner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(z: f64, half: f64) -> Vec<DVec3> {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| DVec3::new(x * half, y * half, z))
            .to_vec()
    }

    fn area(polygon: &[DVec3]) -> f64 {
        (1..polygon.len().max(2) - 1)
            .map(|at| (polygon[at] - polygon[0]).cross(polygon[at + 1] - polygon[0]).length() / 2.0)
            .sum()
    }

    #[test]
    fn a_beam_through_a_window_lights_its_projection() {
        let beam = Beam::new(DVec3::ZERO, &square(1.0, 1.0));
        let mut polygon = Polygon::default();
        let mut lit = |corners: Vec<DVec3>| {
            polygon.set(&corners);
            beam.clip(&mut polygon, 0.0);
            polygon.corners.clone()
        };
        assert!((area(&lit(square(3.0, 10.0))) - 36.0).abs() < 1e-9);
        assert!((area(&lit(square(3.0, 2.0))) - 16.0).abs() < 1e-9);
        let aside: Vec<DVec3> = square(3.0, 1.0).into_iter().map(|corner| corner + DVec3::X * 4.5).collect();
        assert!(lit(aside).is_empty());
    }

    #[test]
    fn balls_outside_are_missed_and_balls_across_a_side_are_not() {
        let beam = Beam::new(DVec3::ZERO, &square(1.0, 1.0));
        assert!(beam.misses(DVec3::new(10.0, 0.0, 3.0), 1.0));
        assert!(!beam.misses(DVec3::new(4.0, 0.0, 3.0), 1.0));
        assert!(!beam.misses(DVec3::new(0.0, 0.0, 3.0), 0.1));
    }

    /// A disc of 4000 corners, off the origin and tilted.
    #[test]
    fn the_outline_of_many_corners_is_a_polygon_of_few_about_them() {
        let normal = DVec3::new(0.3, -0.5, 0.8).normalize();
        let (right, up) = normal.any_orthonormal_pair();
        let disc: Vec<DVec3> = (0..4000)
            .map(|at| libm::sincos(TAU * f64::from(at) / 4000.0))
            .map(|(sine, cosine)| DVec3::new(70.0, 3.0, 5.0) + 2.0 * cosine * right + 2.0 * sine * up)
            .collect();
        let outline = outline(&disc, normal);
        assert_eq!(outline.len(), MOST_CORNERS);
        for (at, corner) in outline.iter().enumerate() {
            let inward = normal.cross(outline[(at + 1) % MOST_CORNERS] - *corner).normalize();
            assert!(disc.iter().all(|point| inward.dot(*point - *corner) > -1e-9), "side {at}");
        }
        let (found, exact) = (area(&outline), TAU / 2.0 * 4.0);
        assert!(found > exact && found < 1.001 * exact, "{found} {exact}");
    }

    #[test]
    fn the_hull_of_an_l_is_its_convex_outline() {
        let corners = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0), (0.5, 0.5)];
        let points: Vec<DVec3> = corners.iter().map(|&(x, y)| DVec3::new(x, y, 2.0)).collect();
        let outline = hull(&points, DVec3::Z);
        assert_eq!(outline.len(), 5);
        assert!((area(&outline) - 7.0).abs() < 1e-12);
    }
}
