//! Elementary functions of complex numbers, by `libm`: the same bits on every platform.
//!
//! Branches are the principal ones. Every function keeps its relative accuracy at small arguments, where the contours of
//! `contour` begin.

pub use num_complex::Complex64 as Complex;

/// e^(j angle), `angle` in radians.
#[must_use]
pub fn unit(angle: f64) -> Complex {
    let (sine, cosine) = libm::sincos(angle);
    Complex::new(cosine, sine)
}

/// √z with a real part of at least 0.
#[must_use]
pub fn root(z: Complex) -> Complex {
    // Nothing here is so large or so small that its square is not a number: no hypot is needed.
    let modulus = z.norm_sqr().sqrt();
    if modulus <= 0.0 {
        return Complex::ZERO;
    }
    // The larger of the two parts first: the other follows without cancellation.
    let larger = (0.5 * (modulus + z.re.abs())).sqrt();
    let smaller = 0.5 * z.im / larger;
    if z.re >= 0.0 {
        Complex::new(larger, smaller)
    } else {
        Complex::new(smaller.abs(), if z.im < 0.0 { -larger } else { larger })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_square_back_on_the_right_side() {
        for (re, im) in [(3.0, 4.0), (-3.0, 4.0), (-3.0, -4.0), (1e-20, -1e-12), (-1.0, 0.0)] {
            let z = Complex::new(re, im);
            let root = root(z);
            assert!(root.re >= 0.0 && (root * root - z).norm() <= 1e-14 * z.norm(), "{z:?}");
        }
        assert_eq!(root(Complex::ZERO), Complex::ZERO);
    }
}
