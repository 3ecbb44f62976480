//! Gauss–Legendre quadrature of eight nodes: exact for polynomials up to degree fifteen.

/// Nodes in (0, 1) of the positive half and their weights, on the interval −1…1 (Abramowitz & Stegun, table 25.4).
const HALF: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// ∫ f over `low`…`high`.
pub(crate) fn integrate(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    HALF.iter()
        .map(|&(node, weight)| weight * (f(middle - half * node) + f(middle + half * node)))
        .sum::<f64>()
        * half
}

/// ∫∫ f over a rectangle.
pub(crate) fn integrate_rectangle(low: [f64; 2], high: [f64; 2], f: impl Fn([f64; 2]) -> f64) -> f64 {
    integrate(low[0], high[0], |x| integrate(low[1], high[1], |y| f([x, y])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_degree_fifteen_are_exact_and_of_sixteen_are_not() {
        let error = |degree: i32| integrate(0.0, 1.0, |x| x.powi(degree)) * f64::from(degree + 1) - 1.0;
        (0..16).for_each(|degree| assert!(error(degree).abs() < 1e-14, "degree {degree}: {}", error(degree)));
        assert!(integrate(-1.0, 1.0, |x| x.powi(16)) * 8.5 - 1.0 < -1e-6);
    }

    #[test]
    fn rectangles_are_products_of_intervals() {
        let value = integrate_rectangle([0.0, 1.0], [2.0, 3.0], |[x, y]| x * y * y);
        assert!((value - 2.0 * 26.0 / 3.0).abs() < 1e-12, "{value}");
    }
}
