//! Triangles between directions: the convex hull of their unit vectors, for barycentric weights.
//!
//! A stereographic projection takes circles to circles, so the triangles are those of a Delaunay triangulation in the plane. Its centre is one of the
//! directions, which has the triangles over the border of the others.

use glam::DVec3;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

/// Directions closer to the centre of projection than this are the same one: 1 − cos.
const SAME: f64 = 1e-10;

/// Belts of latitude, in each of which few of many triangles are sought.
const BELTS: usize = 90;

/// Coordinates closer to 0 are 0: spade refuses what is nearly no number.
const NOTHING: f64 = 1e-30;

/// Triangles that surround the origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Triangles {
    triangles: Vec<Triangle>,
    /// Numbers of the triangles that reach into each belt, from south to north.
    belts: Vec<Vec<usize>>,
}

/// Three directions.
#[derive(Debug, Clone, PartialEq)]
struct Triangle {
    corners: [usize; 3],
    /// Rows of the inverse of the matrix whose columns are the corners.
    inverse: [DVec3; 3],
}

/// Weights of three directions.
pub type Weights = [(usize, f64); 3];

struct Projected {
    index: usize,
    place: Point2<f64>,
}

impl HasPosition for Projected {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.place
    }
}

impl Triangles {
    /// Between unit vectors of which no half of a sphere is free.
    ///
    /// # Panics
    /// Without a direction, or where one is not finite.
    #[must_use]
    pub fn new(directions: &[DVec3]) -> Self {
        let centre = directions[0];
        let (x, y) = centre.any_orthonormal_pair();
        let mut plane = DelaunayTriangulation::<Projected>::new();
        for (index, direction) in directions.iter().enumerate().skip(1) {
            let depth = 1.0 - direction.dot(centre);
            if depth > SAME {
                let [x, y] = [x, y].map(|axis| direction.dot(axis) / depth);
                let tame = |value: f64| if value.abs() < NOTHING { 0.0 } else { value };
                let place = Point2::new(tame(x), tame(y));
                plane.insert(Projected { index, place }).expect("a finite point");
            }
        }
        let inner = plane.inner_faces().map(|face| face.vertices().map(|vertex| vertex.data().index));
        let outer = plane.convex_hull().map(|edge| {
            let [from, to] = edge.vertices().map(|vertex| vertex.data().index);
            [0, from, to]
        });
        let triangles: Vec<Triangle> =
            inner.chain(outer).filter_map(|corners| Triangle::new(directions, corners)).collect();
        let mut belts = vec![Vec::new(); BELTS];
        for (number, triangle) in triangles.iter().enumerate() {
            let corners = triangle.corners.map(|corner| directions[corner]);
            // The cap about the middle that holds the corners holds all between them, where it is less than half the sphere.
            let middle = corners.iter().sum::<DVec3>().try_normalize();
            let least = middle.map_or(-1.0, |middle| {
                corners.map(|corner| corner.dot(middle)).into_iter().fold(1.0, f64::min)
            });
            let (first, last) = if least > 0.0 {
                let (latitude, radius) = (latitude(middle.unwrap_or(DVec3::Z)), libm::acos(least) + MARGIN);
                (belt(latitude - radius), belt(latitude + radius))
            } else {
                (0, BELTS - 1)
            };
            belts[first..=last].iter_mut().for_each(|belt| belt.push(number));
        }
        Self { triangles, belts }
    }

    /// Barycentric weights of a direction in the triangle that contains it.
    #[must_use]
    pub fn weights(&self, u: DVec3) -> Weights {
        let mut best = (f64::NEG_INFINITY, [0.0; 3], [0; 3]);
        for &number in &self.belts[belt(latitude(u))] {
            let triangle = &self.triangles[number];
            let weights = triangle.inverse.map(|row| row.dot(u));
            let least = weights[0].min(weights[1]).min(weights[2]);
            if least > best.0 {
                best = (least, weights, triangle.corners);
            }
            // Others contain it at most at a border.
            if least >= 0.0 {
                break;
            }
        }
        let weights = best.1.map(|weight| weight.max(0.0));
        let sum: f64 = weights.iter().sum();
        std::array::from_fn(|corner| (best.2[corner], weights[corner] / sum))
    }
}

/// Added to the extent of a triangle, far above rounding [rad].
const MARGIN: f64 = 1e-6;

/// Angle of a unit vector above the horizontal plane [rad].
fn latitude(u: DVec3) -> f64 {
    libm::asin(u.z.clamp(-1.0, 1.0))
}

/// Number of the belt of a latitude [rad].
fn belt(latitude: f64) -> usize {
    let share = latitude / core::f64::consts::PI + 0.5;
    ((share * BELTS as f64).max(0.0) as usize).min(BELTS - 1)
}

impl Triangle {
    /// None where the corners are one.
    fn new(directions: &[DVec3], corners: [usize; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|corner| directions[corner]);
        let inverse = [b.cross(c), c.cross(a), a.cross(b)].map(|row| row / a.dot(b.cross(c)));
        inverse.iter().all(|row| row.is_finite()).then_some(Self { corners, inverse })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_direction_that_is_nearly_on_an_axis_is_no_panic() {
        let axes =
            [DVec3::X, DVec3::NEG_X, DVec3::new(1e-60, 1.0, -1e-200), DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        let weights = Triangles::new(&axes).weights(DVec3::new(0.0, 0.6, 0.8));
        let of = |corner| weights.iter().find(|(at, _)| *at == corner).map_or(0.0, |(_, weight)| *weight);
        assert!((of(2) - 3.0 / 7.0).abs() < 1e-9 && (of(4) - 4.0 / 7.0).abs() < 1e-9, "{weights:?}");
    }

    /// A grid of 10°, whose quadrangles lie in planes, has its own directions with weight 1 and all others between neighbours.
    #[test]
    fn weights_are_those_of_the_surrounding_directions() {
        let grid: Vec<DVec3> = (-8..=9)
            .flat_map(|row| (0..if row == 9 { 1 } else { 36 }).map(move |column| (row, column)))
            .map(|(row, column)| {
                let (sine, cosine) = (f64::from(row) * PI / 18.0).sin_cos();
                let (y, x) = (f64::from(column) * PI / 18.0).sin_cos();
                DVec3::new(cosine * x, cosine * y, sine)
            })
            .collect();
        let triangles = Triangles::new(&grid);
        for (index, direction) in grid.iter().enumerate() {
            let own = triangles
                .weights(*direction)
                .iter()
                .find(|(corner, _)| *corner == index)
                .map(|(_, own)| *own);
            assert!(own.is_some_and(|own| own > 1.0 - 1e-9), "{index}: {own:?}");
        }
        let mut draw = sonel_testkit::uniform::Uniform::new(7);
        for _ in 0..2000 {
            let z = draw.between(-0.98, 1.0);
            let (y, x) = draw.between(0.0, 2.0 * PI).sin_cos();
            let u = DVec3::new((1.0 - z * z).sqrt() * x, (1.0 - z * z).sqrt() * y, z);
            let weights = triangles.weights(u);
            let mean: DVec3 = weights.iter().map(|(corner, weight)| *weight * grid[*corner]).sum();
            assert!(mean.normalize().distance(u) < 1e-9, "{u}: {weights:?}");
            for (corner, _) in weights {
                assert!(grid[corner].dot(u) > (15.0_f64).to_radians().cos(), "{u}: {weights:?}");
            }
        }
    }
}
