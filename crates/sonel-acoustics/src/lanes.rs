//! Band values in lanes of four, so that the compiler vectorises; lanes after the last band are zero.
//!
//! The values of all bands are a slice of [`Lanes`], with the arithmetic of [`BandValues`]. Only this module knows in
//! which lane a band is.

use core::ops::{Add, AddAssign, Div, DivAssign, Index, IndexMut, Mul, MulAssign, Sub, SubAssign};

use bytemuck::{Pod, Zeroable};

/// Values of four bands; every operation is one of each lane.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(transparent)]
pub struct Lanes([f64; 4]);

/// Number of [`Lanes`] that hold `bands` bands.
#[must_use]
pub const fn lanes_of(bands: usize) -> usize {
    bands.div_ceil(Lanes::COUNT)
}

/// Values of the bands in lanes, zeros behind.
#[must_use]
pub fn to_lanes(values: impl IntoIterator<Item = f64>) -> Vec<Lanes> {
    let mut lanes = Vec::new();
    for (band, value) in values.into_iter().enumerate() {
        lanes.resize(lanes_of(band + 1), Lanes::ZERO);
        *lanes.band_mut(band) = value;
    }
    lanes
}

impl Lanes {
    /// Number of lanes.
    pub const COUNT: usize = 4;
    /// Zero in every lane.
    pub const ZERO: Self = Self::splat(0.0);
    /// One in every lane.
    pub const ONE: Self = Self::splat(1.0);

    /// `value` in every lane.
    #[inline]
    #[must_use]
    pub const fn splat(value: f64) -> Self {
        Self([value; Self::COUNT])
    }

    /// `f` of every lane.
    #[inline]
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let [a, b, c, d] = self.0;
        Self([f(a), f(b), f(c), f(d)])
    }

    // Written out: compilers make vectors of it, which they do not of `array::from_fn`.
    #[inline]
    fn with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let ([a, b, c, d], [x, y, z, w]) = (self.0, other.0);
        Self([f(a, x), f(b, y), f(c, z), f(d, w)])
    }

    /// The larger one in every lane.
    #[inline]
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        self.with(other, |a, b| a.max(b))
    }

    /// `positive` in the lanes that are above zero, `otherwise` in the others.
    #[inline]
    #[must_use]
    pub fn select(self, positive: Self, otherwise: Self) -> Self {
        let of = |lane: usize| if self.0[lane] > 0.0 { positive.0[lane] } else { otherwise.0[lane] };
        Self([of(0), of(1), of(2), of(3)])
    }

    /// Sum of the lanes.
    #[inline]
    #[must_use]
    pub fn sum(self) -> f64 {
        let [a, b, c, d] = self.0;
        (a + b) + (c + d)
    }

    /// The largest lane.
    #[inline]
    #[must_use]
    pub fn largest(self) -> f64 {
        let [a, b, c, d] = self.0;
        a.max(b).max(c.max(d))
    }
}

/// Lane by lane: of four bands at most, the band.
impl Index<usize> for Lanes {
    type Output = f64;

    #[inline]
    fn index(&self, lane: usize) -> &f64 {
        &self.0[lane]
    }
}

impl IndexMut<usize> for Lanes {
    #[inline]
    fn index_mut(&mut self, lane: usize) -> &mut f64 {
        &mut self.0[lane]
    }
}

macro_rules! operators {
    ($($operator:ident $function:ident $assign:ident $assign_function:ident),+) => {$(
        impl $operator for Lanes {
            type Output = Self;

            #[inline]
            fn $function(self, other: Self) -> Self {
                self.with(other, |a, b| a.$function(b))
            }
        }

        impl $operator<f64> for Lanes {
            type Output = Self;

            #[inline]
            fn $function(self, other: f64) -> Self {
                self.map(|lane| lane.$function(other))
            }
        }

        impl $assign for Lanes {
            #[inline]
            fn $assign_function(&mut self, other: Self) {
                *self = self.$function(other);
            }
        }

        impl $assign<f64> for Lanes {
            #[inline]
            fn $assign_function(&mut self, other: f64) {
                *self = self.$function(other);
            }
        }
    )+};
}
operators!(Add add AddAssign add_assign, Sub sub SubAssign sub_assign, Mul mul MulAssign mul_assign, Div div DivAssign div_assign);

/// Arithmetic of the values of all bands; operands have as many bands.
pub trait BandValues: AsRef<[Lanes]> + AsMut<[Lanes]> {
    /// Value of `band`.
    #[inline]
    fn band(&self, band: usize) -> f64 {
        self.as_ref()[band / Lanes::COUNT][band % Lanes::COUNT]
    }

    /// Value of `band`.
    #[inline]
    fn band_mut(&mut self, band: usize) -> &mut f64 {
        &mut self.as_mut()[band / Lanes::COUNT][band % Lanes::COUNT]
    }

    /// Values in the order of the bands, with the zeros behind.
    #[inline]
    fn values(&self) -> impl Iterator<Item = f64> {
        bytemuck::cast_slice(self.as_ref()).iter().copied()
    }

    /// The same to be changed.
    #[inline]
    fn values_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        bytemuck::cast_slice_mut(self.as_mut()).iter_mut()
    }

    /// The largest value, at least 0.
    #[inline]
    fn largest(&self) -> f64 {
        self.as_ref().iter().fold(Lanes::ZERO, |largest, &lanes| largest.max(lanes)).largest()
    }

    /// Adds `other`.
    #[inline]
    fn add(&mut self, other: &[Lanes]) {
        self.as_mut().iter_mut().zip(other).for_each(|(sum, &other)| *sum += other);
    }

    /// Subtracts `other`.
    #[inline]
    fn subtract(&mut self, other: &[Lanes]) {
        self.as_mut().iter_mut().zip(other).for_each(|(sum, &other)| *sum -= other);
    }

    /// Adds `weight` times `other`.
    #[inline]
    fn add_times(&mut self, other: &[Lanes], weight: f64) {
        self.as_mut().iter_mut().zip(other).for_each(|(sum, &other)| *sum += other * weight);
    }

    /// Adds the product of `a` and `b`.
    #[inline]
    fn add_product(&mut self, a: &[Lanes], b: &[Lanes]) {
        self.as_mut().iter_mut().zip(a).zip(b).for_each(|((sum, &a), &b)| *sum += a * b);
    }

    /// Multiplies by `factors`.
    #[inline]
    fn multiply(&mut self, factors: &[Lanes]) {
        self.as_mut().iter_mut().zip(factors).for_each(|(product, &factor)| *product *= factor);
    }

    /// Multiplies every band by `factor`.
    #[inline]
    fn scale(&mut self, factor: f64) {
        self.as_mut().iter_mut().for_each(|lanes| *lanes *= factor);
    }

    /// Divides every band by `divisor`.
    #[inline]
    fn divide(&mut self, divisor: f64) {
        self.as_mut().iter_mut().for_each(|lanes| *lanes /= divisor);
    }

    /// Becomes `weight` times `other`.
    #[inline]
    fn set_times(&mut self, other: &[Lanes], weight: f64) {
        self.as_mut().iter_mut().zip(other).for_each(|(out, &other)| *out = other * weight);
    }

    /// Becomes the product of `a`, `b` and `scale`, in this order.
    #[inline]
    fn set_product(&mut self, a: &[Lanes], b: &[Lanes], scale: f64) {
        self.as_mut().iter_mut().zip(a).zip(b).for_each(|((out, &a), &b)| *out = a * b * scale);
    }
}

impl BandValues for [Lanes] {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_where_they_were_put_with_zeros_behind() {
        for bands in 1..10 {
            let values: Vec<f64> = (1..=bands).map(|band| band as f64).collect();
            let lanes = to_lanes(values.iter().copied());
            assert_eq!(lanes.len(), lanes_of(bands));
            assert_eq!((0..bands).map(|band| lanes.band(band)).collect::<Vec<_>>(), values);
            assert_eq!(lanes.values().skip(bands).collect::<Vec<_>>(), vec![0.0; 4 * lanes.len() - bands]);
        }
    }

    #[test]
    fn operations_are_those_of_numbers_lane_by_lane() {
        let (a, b) = (Lanes([1.0, -2.0, 0.0, 8.0]), Lanes([3.0, 0.5, 2.0, -4.0]));
        assert_eq!([a + b, a - b], [Lanes([4.0, -1.5, 2.0, 4.0]), Lanes([-2.0, -2.5, -2.0, 12.0])]);
        assert_eq!([a * b, a / b], [Lanes([3.0, -1.0, 0.0, -32.0]), Lanes([1.0 / 3.0, -4.0, 0.0, -2.0])]);
        assert_eq!([a.max(b), a * 2.0], [Lanes([3.0, 0.5, 2.0, 8.0]), Lanes([2.0, -4.0, 0.0, 16.0])]);
        assert_eq!(a.select(b, Lanes::ONE), Lanes([3.0, 1.0, 1.0, -4.0]));
        let mut product = [Lanes::ZERO];
        product.set_product(&[a], &[b], 0.5);
        assert_eq!(product, [Lanes([1.5, -0.5, 0.0, -16.0])]);
        assert_eq!(vec![a.sum(), a.largest(), [b, a].largest()], vec![7.0, 8.0, 8.0]);
    }
}
