//! Form factors: share of the energy leaving one rectangle by the cosine law that arrives at another, in closed form.
//!
//! Both rectangles are sides of cells of one regular grid, so their exchange depends on offsets alone; it is the
//! alternating sum of one antiderivative over the corners.
//!
//! Reference: J. R. Howell, A Catalog of Radiation Heat Transfer Configuration Factors, C-13 (parallel) and C-15 (perpendicular).

use std::f64::consts::{PI, TAU};

/// Fourfold antiderivative of cos θ cos θ′/(π d²) for parallel planes at distance `z`, offsets `x`, `y` [m²].
fn parallel(x: f64, y: f64, z: f64) -> f64 {
    let slanted = |u: f64, v: f64| {
        let root = v.hypot(z);
        u * root * (u / root).atan()
    };
    (slanted(x, y) + slanted(y, x) - 0.5 * z * z * (x * x + y * y + z * z).ln()) / TAU
}

/// The same for perpendicular planes: distances `p`, `q` from their common line, offset `y` along it [m²].
fn perpendicular(p: f64, q: f64, y: f64) -> f64 {
    let (square, root) = (p * p + q * q, p.hypot(q));
    let sum = square + y * y;
    let slanted = if root > 0.0 { y * root * (y / root).atan() } else { 0.0 };
    // x ln x vanishes with x, which happens at the shared corner of two cells.
    let logarithm = if sum > 0.0 { 0.25 * (square - y * y) * sum.ln() } else { 0.0 };
    (slanted - logarithm) / TAU
}

/// Alternating sum of f over the differences of the ends of two intervals.
fn pairs_of_ends(first: [f64; 2], second: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    f(first[0] - second[0]) + f(first[1] - second[1]) - f(first[0] - second[1]) - f(first[1] - second[0])
}

/// Exchange A·F [m²] between two rectangles in parallel planes `gap` [m] apart, each given by its intervals along
/// the two axes of the planes [m].
pub(super) fn parallel_exchange(first: [[f64; 2]; 2], second: [[f64; 2]; 2], gap: f64) -> f64 {
    pairs_of_ends(first[0], second[0], |x| pairs_of_ends(first[1], second[1], |y| parallel(x, y, gap)))
}

/// Exchange A·F [m²] between two rectangles in perpendicular planes, each given by the interval of its distances
/// from the common line and by the interval along that line [m].
pub(super) fn perpendicular_exchange(first: [[f64; 2]; 2], second: [[f64; 2]; 2]) -> f64 {
    let corner = |i: usize, j: usize, y: f64| perpendicular(first[0][i], second[0][j], y);
    pairs_of_ends(first[1], second[1], |y| {
        corner(1, 1, y) - corner(0, 1, y) - corner(1, 0, y) + corner(0, 0, y)
    })
}

/// Solid angle [sr] of the rectangle `low`…`high`, given in its plane with the foot of the perpendicular from the
/// observer as origin, at `distance` > 0 [m].
pub(super) fn solid_angle(low: [f64; 2], high: [f64; 2], distance: f64) -> f64 {
    let corner = |x: f64, y: f64| (x * y / (distance * (x * x + y * y + distance * distance).sqrt())).atan();
    let angle =
        corner(high[0], high[1]) - corner(low[0], high[1]) - corner(high[0], low[1]) + corner(low[0], low[1]);
    assert!((-1e-12..2.0 * PI + 1e-12).contains(&angle));
    angle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::integrate_rectangle;

    const UNIT: [f64; 2] = [0.0, 1.0];

    #[test]
    fn opposite_sides_of_a_cube_exchange_a_fifth() {
        let opposite = parallel_exchange([UNIT; 2], [UNIT; 2], 1.0);
        let adjacent = perpendicular_exchange([UNIT; 2], [UNIT; 2]);
        assert!((opposite - 0.199_824_9).abs() < 1e-7, "{opposite}");
        assert!((adjacent - 0.200_043_8).abs() < 1e-7, "{adjacent}");
        assert!((opposite + 4.0 * adjacent - 1.0).abs() < 1e-12);
    }

    /// ∫∫ over one rectangle of ∫∫ over the other.
    fn by_quadrature(
        first: [[f64; 2]; 2],
        second: [[f64; 2]; 2],
        kernel: impl Fn([f64; 2], [f64; 2]) -> f64,
    ) -> f64 {
        let over = |r: [[f64; 2]; 2], f: &dyn Fn([f64; 2]) -> f64| {
            integrate_rectangle([r[0][0], r[1][0]], [r[0][1], r[1][1]], f)
        };
        over(first, &|a| over(second, &|b| kernel(a, b)))
    }

    #[test]
    fn closed_forms_are_what_quadrature_finds() {
        let (first, gap) = ([[0.0, 0.5], [0.3, 1.0]], 3.0);
        for second in [first, [[1.5, 1.9], [-2.1, -1.0]]] {
            let kernel = |a: [f64; 2], b: [f64; 2]| {
                let (x, y) = (a[0] - b[0], a[1] - b[1]);
                gap * gap / (PI * (x * x + y * y + gap * gap).powi(2))
            };
            let expected = by_quadrature(first, second, kernel);
            let found = parallel_exchange(first, second, gap);
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
        let (first, second) = ([[1.0, 1.5], [0.0, 0.4]], [[0.5, 1.2], [0.8, 1.7]]);
        let kernel = |a: [f64; 2], b: [f64; 2]| {
            let (p, q, y) = (a[0], b[0], a[1] - b[1]);
            p * q / (PI * (p * p + q * q + y * y).powi(2))
        };
        let expected = by_quadrature(first, second, kernel);
        let found = perpendicular_exchange(first, second);
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        let shifted = perpendicular_exchange([[1.0, 1.5], [0.0, 0.5]], second);
        assert!((shifted / expected - 1.0).abs() > 0.1);
    }

    #[test]
    fn a_cube_fills_the_sphere_of_directions() {
        let face = solid_angle([-1.0, -1.0], [1.0, 1.0], 1.0);
        assert!((6.0 * face - 2.0 * TAU).abs() < 1e-12);
        let off = solid_angle([1.0, 2.0], [1.01, 2.01], 3.0);
        let expected = 1e-4 * 3.0 / (1.005_f64.powi(2) + 2.005_f64.powi(2) + 9.0).powf(1.5);
        assert!((off / expected - 1.0).abs() < 1e-5, "{off} {expected}");
    }
}
