//! Owen-scrambled Sobol' points in the unit square: emission directions that fill the sphere evenly at every count.
//!
//! Each batch scrambles the same sequence on its own, so batches are independent and identically distributed (the
//! jackknife over batches stays valid), while inside a batch every prefix of 2^m points is a (0, m, 2)-net. The points
//! do not depend on how many will be drawn: a map can be extended.
//!
//! References: [Sobol1967], [Owen1995]; the nested scramble as a hash on reversed bits is [LaineKarras2011], its
//! constants those of [Burley2020] (docs/references.md).

use crate::stream::{Purpose, StreamFamily, unit_f32};

/// The scrambled sequence of one batch.
#[derive(Debug, Clone, Copy)]
pub struct ScrambledSobol {
    keys: [u32; 2],
}

impl ScrambledSobol {
    /// Sequence `number` of the emissions of `source` under `seed`.
    #[must_use]
    pub fn numbered(seed: u64, source: u32, number: u32) -> Self {
        let mut stream =
            StreamFamily::new(seed, Purpose::EmissionScramble, [source, 0, 0, 0]).stream(u64::from(number));
        Self::from_keys([stream.bits(), stream.bits()])
    }

    /// The sequence scrambled with `keys`, one for each coordinate.
    #[must_use]
    pub fn from_keys(keys: [u32; 2]) -> Self {
        Self { keys }
    }

    /// 32 bits that look random, one for every `round`: for choices that go with the sequence.
    #[must_use]
    pub fn turn(&self, round: u32) -> u32 {
        scramble(scramble(round, self.keys[0]) ^ self.keys[1], self.keys[0].rotate_left(16))
    }

    /// Point `index` of the sequence in [0, 1)².
    #[must_use]
    pub fn point(&self, index: u32) -> [f32; 2] {
        [
            unit_f32(scramble(index.reverse_bits(), self.keys[0])),
            unit_f32(scramble(second_dimension(index), self.keys[1])),
        ]
    }
}

/// Second coordinate of the unscrambled sequence as a 32-bit fraction; its direction numbers are rows of Pascal's
/// triangle modulo two.
fn second_dimension(mut index: u32) -> u32 {
    let (mut point, mut direction) = (0, 1_u32 << 31);
    while index != 0 {
        if index & 1 == 1 {
            point ^= direction;
        }
        direction ^= direction >> 1;
        index >>= 1;
    }
    point
}

/// A random permutation of the binary tree of digits: every bit is flipped depending on the bits above it alone.
fn scramble(fraction: u32, key: u32) -> u32 {
    let mut x = fraction.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts how many of the first 2^m points fall into each elementary cell of 2^a × 2^(m−a).
    fn fullest_cell(sequence: &ScrambledSobol, m: u32, a: u32) -> u32 {
        let (columns, rows) = (1_u32 << a, 1_u32 << (m - a));
        let mut counts = vec![0_u32; 1 << m];
        for index in 0..1 << m {
            let [u, v] = sequence.point(index);
            counts[((u * columns as f32) as u32 * rows + (v * rows as f32) as u32) as usize] += 1;
        }
        counts.into_iter().max().unwrap()
    }

    #[test]
    fn every_elementary_cell_holds_one_point() {
        for batch in 0..4 {
            let sequence = ScrambledSobol::numbered(1, 0, batch);
            for a in 0..=8 {
                assert_eq!(fullest_cell(&sequence, 8, a), 1, "batch {batch}, 2^{a} columns");
            }
        }
    }

    #[test]
    fn plain_random_points_are_rejected_by_the_same_count() {
        let mut stream = StreamFamily::new(1, Purpose::Packet, [0; 4]).stream(0);
        let mut counts = [0_u32; 256];
        for _ in 0..256 {
            counts[(stream.uniform() * 256.0) as usize] += 1;
        }
        assert!(counts.into_iter().max().unwrap() > 1);
    }

    /// The first point over many batches must be uniform: it carries the whole variance between batches.
    #[test]
    fn one_point_is_uniform_over_batches() {
        let (mut sum, mut square) = ([0.0_f64; 2], [0.0_f64; 2]);
        let batches = 20_000;
        for batch in 0..batches {
            for (axis, u) in ScrambledSobol::numbered(7, 0, batch).point(5).into_iter().enumerate() {
                sum[axis] += f64::from(u);
                square[axis] += f64::from(u) * f64::from(u);
            }
        }
        let n = f64::from(batches);
        for axis in 0..2 {
            // Standard errors of the mean (√(1/12)) and of the mean square (√(4/45)) of a uniform number.
            assert!((sum[axis] / n - 0.5).abs() < 4.0 * (1.0 / 12.0 / n).sqrt());
            assert!((square[axis] / n - 1.0 / 3.0).abs() < 4.0 * (4.0 / 45.0 / n).sqrt());
        }
    }
}
