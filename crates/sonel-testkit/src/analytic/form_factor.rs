//! How much of the energy leaving one rectangle after the cosine law arrives at another, in closed form.
//!
//! Both rectangles are sides of cells of one regular grid, so their exchange depends on offsets alone; it is the
//! alternating sum of one antiderivative over the corners.
//!
//! Reference: [Howell2010], configurations C-13 (parallel) and C-15 (perpendicular).

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

/// Second difference with step `step`, negated: the alternating sum over the four pairs of ends of two equal
/// intervals whose offset is `at`.
fn pairs_of_ends(at: f64, step: f64, f: impl Fn(f64) -> f64) -> f64 {
    2.0 * f(at) - f(at - step) - f(at + step)
}

/// Exchange A·F [m²] between two `cell`-sized rectangles in parallel planes `gap` [m] apart, with the given
/// `offset` [m] between them.
pub(super) fn parallel_exchange(cell: [f64; 2], offset: [f64; 2], gap: f64) -> f64 {
    pairs_of_ends(offset[0], cell[0], |x| pairs_of_ends(offset[1], cell[1], |y| parallel(x, y, gap)))
}

/// Exchange A·F [m²] between rectangles in perpendicular planes: `near` and `far` are the distances of their ends
/// from the common line [m], along which both are `width` wide and `offset` apart [m].
pub(super) fn perpendicular_exchange(near: [f64; 2], far: [f64; 2], width: f64, offset: f64) -> f64 {
    pairs_of_ends(offset, width, |y| {
        let corner = |i: usize, j: usize| perpendicular([near[0], far[0]][i], [near[1], far[1]][j], y);
        corner(1, 1) - corner(0, 1) - corner(1, 0) + corner(0, 0)
    })
}

/// Solid angle [sr] of the rectangle `low`…`high`, given in its plane with the foot of the perpendicular from the
/// observer as origin, at `distance` > 0 [m].
pub(super) fn solid_angle(low: [f64; 2], high: [f64; 2], distance: f64) -> f64 {
    let corner = |x: f64, y: f64| (x * y / (distance * (x * x + y * y + distance * distance).sqrt())).atan();
    let angle =
        corner(high[0], high[1]) - corner(low[0], high[1]) - corner(high[0], low[1]) + corner(low[0], low[1]);
    debug_assert!((-1e-12..2.0 * PI + 1e-12).contains(&angle));
    angle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::integrate_rectangle;

    #[test]
    fn opposite_sides_of_a_cube_exchange_a_fifth() {
        let opposite = parallel_exchange([1.0, 1.0], [0.0, 0.0], 1.0);
        let adjacent = perpendicular_exchange([0.0, 0.0], [1.0, 1.0], 1.0, 0.0);
        assert!((opposite - 0.199_824_9).abs() < 1e-7, "{opposite}");
        assert!((adjacent - 0.200_043_8).abs() < 1e-7, "{adjacent}");
        assert!((opposite + 4.0 * adjacent - 1.0).abs() < 1e-12);
    }

    #[test]
    fn closed_forms_are_what_quadrature_finds() {
        let (cell, gap) = ([0.5, 0.7], 3.0);
        for offset in [[0.0, 0.0], [1.5, -2.1]] {
            let kernel = |x: f64, y: f64| gap * gap / (PI * (x * x + y * y + gap * gap).powi(2));
            let inner = |a: [f64; 2]| {
                integrate_rectangle([0.0; 2], cell, |b| {
                    kernel(offset[0] + b[0] - a[0], offset[1] + b[1] - a[1])
                })
            };
            let expected = integrate_rectangle([0.0; 2], cell, inner);
            let found = parallel_exchange(cell, offset, gap);
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
        let (near, far, width, offset) = ([1.0, 0.5], [1.5, 1.2], 0.4, 0.8);
        let kernel = |p: f64, q: f64, y: f64| p * q / (PI * (p * p + q * q + y * y).powi(2));
        let inner = |a: [f64; 2]| {
            let ([low, _], [high, _]) = ([near[1], 0.0], [far[1], width]);
            integrate_rectangle([low, 0.0], [high, width], |b| kernel(a[0], b[0], offset + b[1] - a[1]))
        };
        let expected = integrate_rectangle([near[0], 0.0], [far[0], width], inner);
        let found = perpendicular_exchange(near, far, width, offset);
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
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
