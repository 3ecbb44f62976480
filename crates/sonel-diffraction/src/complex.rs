//! Complex arithmetic and elementary functions by `libm`.
//!
//! Branches are the principal ones. Every function keeps its relative accuracy at small arguments, where the contours of
//! `contour` begin.

use std::ops::{Add, AddAssign, Div, Mul, Sub};

/// A complex number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Complex {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

impl Complex {
    /// 0.
    pub const ZERO: Self = Self::new(0.0, 0.0);

    /// re + j im.
    #[must_use]
    pub const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    /// A real number.
    #[must_use]
    pub const fn real(re: f64) -> Self {
        Self::new(re, 0.0)
    }

    /// e^(j angle), `angle` in radians.
    #[must_use]
    pub fn unit(angle: f64) -> Self {
        let (sine, cosine) = libm::sincos(angle);
        Self::new(cosine, sine)
    }

    /// The complex conjugate.
    #[must_use]
    pub fn conjugate(self) -> Self {
        Self::new(self.re, -self.im)
    }

    /// |z|².
    #[must_use]
    pub fn square_of_modulus(self) -> f64 {
        self.re * self.re + self.im * self.im
    }

    /// |z|.
    #[must_use]
    pub fn modulus(self) -> f64 {
        libm::hypot(self.re, self.im)
    }

    /// √z with a real part of at least 0.
    #[must_use]
    pub fn sqrt(self) -> Self {
        // Nothing here is so large or so small that its square is not a number: no hypot is needed.
        let modulus = self.square_of_modulus().sqrt();
        if modulus <= 0.0 {
            return Self::ZERO;
        }
        // The larger of the two parts first: the other follows without cancellation.
        let larger = (0.5 * (modulus + self.re.abs())).sqrt();
        let smaller = 0.5 * self.im / larger;
        if self.re >= 0.0 {
            Self::new(larger, smaller)
        } else {
            Self::new(smaller.abs(), if self.im < 0.0 { -larger } else { larger })
        }
    }

    /// 1/z.
    #[must_use]
    pub fn inverse(self) -> Self {
        self.conjugate() * (1.0 / self.square_of_modulus())
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl AddAssign for Complex {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Complex {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self::new(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)
    }
}

impl Mul<f64> for Complex {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.re * factor, self.im * factor)
    }
}

impl Div for Complex {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        self * other.conjugate() * (1.0 / other.square_of_modulus())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Complex, b: Complex) -> bool {
        (a - b).modulus() <= 1e-14 * b.modulus()
    }

    #[test]
    fn roots_square_back_on_the_right_side() {
        for (re, im) in [(3.0, 4.0), (-3.0, 4.0), (-3.0, -4.0), (1e-20, -1e-12), (-1.0, 0.0)] {
            let (z, root) = (Complex::new(re, im), Complex::new(re, im).sqrt());
            assert!(root.re >= 0.0 && close(root * root, z), "{z:?}");
        }
        assert_eq!(Complex::ZERO.sqrt(), Complex::ZERO);
    }

    #[test]
    fn quotients_and_powers_of_e() {
        assert!(close(
            Complex::new(1.0, 2.0) * Complex::new(3.0, -1.0) / Complex::new(3.0, -1.0),
            Complex::new(1.0, 2.0)
        ));
        assert!((Complex::unit(2.0).modulus() - 1.0).abs() < 1e-15);
    }
}
