//! A tiny deterministic generator for tests.
//!
//! SplitMix64 [Steele2014]: one addition and two multiply-xorshifts a number, every seed good, the sequence fixed
//! for ever. It is deliberately not the generator of the simulator, so that a flaw in one cannot hide in the other.

use std::f64::consts::TAU;

/// A stream of uniform numbers, the same for the same seed on every platform.
#[derive(Debug, Clone)]
pub struct Uniform {
    state: u64,
}

impl Uniform {
    /// The stream of `seed`. Streams of different seeds are unrelated.
    pub fn new(seed: u64) -> Self {
        // The seed is mixed once: neighbouring seeds would otherwise be the same sequence, shifted.
        Self { state: mix(seed ^ 0x6A09_E667_F3BC_C909) }
    }

    /// 64 random bits.
    pub fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        mix(self.state)
    }

    /// 32 random bits.
    pub fn next_u32(&mut self) -> u32 {
        (self.next_u64() >> 32) as u32
    }

    /// Uniform in [0, 1), a multiple of 2⁻⁵³.
    pub fn next_f64(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Uniform in [0, 1), a multiple of 2⁻²⁴.
    pub fn next_f32(&mut self) -> f32 {
        (self.next_u64() >> 40) as f32 * (1.0 / (1_u32 << 24) as f32)
    }

    /// Uniform in the unit square [0, 1)².
    pub fn square(&mut self) -> [f64; 2] {
        [self.next_f64(), self.next_f64()]
    }

    /// Uniform in the unit square [0, 1)², for samplers that take `f32`.
    pub fn square_f32(&mut self) -> [f32; 2] {
        [self.next_f32(), self.next_f32()]
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next_f64()
    }

    /// Uniform among 0, 1, … `count` − 1; `count` must be positive. Bias at most `count` · 2⁻⁵³.
    pub fn below(&mut self, count: usize) -> usize {
        (self.next_f64() * count as f64) as usize
    }

    /// Uniform on the unit sphere (z uniform, Archimedes).
    pub fn unit_vector(&mut self) -> [f64; 3] {
        let z = 1.0 - 2.0 * self.next_f64();
        let (sin, cos) = (TAU * self.next_f64()).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        [r * cos, r * sin, z]
    }
}

/// The finaliser of SplitMix64, a bijection of 64 bits.
fn mix(bits: u64) -> u64 {
    let z = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chi_square::{Plan, goodness_of_fit, sphere, square};

    #[test]
    fn the_finaliser_and_the_increment_are_those_of_splitmix64() {
        // The published sequence from state 0 [Steele2014].
        let mut numbers = Uniform { state: 0 };
        assert_eq!(numbers.next_u64(), 0xE220_A839_7B1D_CDAF);
        assert_eq!(numbers.next_u64(), 0x6E78_9E6A_A1B9_65F4);
    }

    #[test]
    fn the_same_seed_gives_the_same_stream_and_another_seed_another() {
        let draw = |seed| {
            let mut numbers = Uniform::new(seed);
            (0..100).map(|_| numbers.next_u64()).collect::<Vec<_>>()
        };
        assert_eq!(draw(7), draw(7));
        assert!(draw(7).iter().zip(draw(8)).all(|(a, b)| *a != b));
    }

    #[test]
    fn pairs_fill_the_square_evenly() {
        let verdict = square(Plan::seeded(1), Uniform::square, |_| 1.0);
        assert!(verdict.accepted(), "{verdict}");
        let f32s = |numbers: &mut Uniform| numbers.square_f32().map(f64::from);
        let verdict = square(Plan::seeded(2), f32s, |_| 1.0);
        assert!(verdict.accepted(), "{verdict}");
    }

    #[test]
    fn a_pair_of_one_number_with_itself_is_rejected() {
        let diagonal = |numbers: &mut Uniform| [numbers.next_f64(); 2];
        assert!(!square(Plan::seeded(1), diagonal, |_| 1.0).accepted());
    }

    #[test]
    fn unit_vectors_fill_the_sphere_evenly() {
        let verdict = sphere(Plan::seeded(3), Uniform::unit_vector, |_| 1.0 / (2.0 * TAU));
        assert!(verdict.accepted(), "{verdict}");
    }

    #[test]
    fn whole_numbers_are_equally_likely() {
        let mut numbers = Uniform::new(4);
        let mut counts = [0_u64; 7];
        (0..70_000).for_each(|_| counts[numbers.below(7)] += 1);
        let fit = goodness_of_fit(&counts, &[1.0 / 7.0; 7]).unwrap();
        assert!(fit.p_value > 1e-3, "{fit:?}");
    }
}
