//! Ranges of the angle of incidence within which events have the same probabilities.
//!
//! Eight ranges an octave of the cosine, down to 2⁻¹⁰, and one below: hard walls absorb most near grazing incidence. Within a range
//! events are drawn for the mean absorption over diffuse incidence. Energies take α at the angle itself: a mean would absorb too much of what
//! is reflected between parallel walls again and again.

/// Below 2⁻¹⁰ is a millionth of diffuse incidence, ∫ 2 cos θ d(cos θ) = 2⁻²⁰.
const OCTAVES: u32 = 10;
/// Eight ranges an octave: the leading bits of a double tell them apart.
const BITS: u32 = 3;
/// 2⁻¹⁰.
const LOWEST: f64 = f64::from_bits(((1023 - OCTAVES) as u64) << 52);

/// Number of ranges.
pub(crate) const RANGES: usize = 1 + ((OCTAVES as usize) << BITS);

/// The range that `cosine` belongs to; the lowest where it is no number.
#[inline]
#[must_use]
pub(crate) fn range_of(cosine: f64) -> usize {
    if cosine >= LOWEST {
        (1 + leading_bits(cosine) - leading_bits(LOWEST)).min(RANGES as u64 - 1) as usize
    } else {
        0
    }
}

/// Smallest and largest cosine of a range.
#[must_use]
pub(crate) fn bounds(range: usize) -> [f64; 2] {
    let lower = |range: usize| {
        let bits = (leading_bits(LOWEST) + range as u64 - 1) << (52 - BITS);
        f64::from_bits(bits)
    };
    if range == 0 { [0.0, LOWEST] } else { [lower(range), lower(range + 1)] }
}

fn leading_bits(number: f64) -> u64 {
    number.to_bits() >> (52 - BITS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_follow_on_one_another_from_grazing_to_normal() {
        assert_eq!((bounds(0)[0], bounds(RANGES - 1)[1]), (0.0, 1.0));
        for range in 0..RANGES {
            let [low, high] = bounds(range);
            assert_eq!((range_of(low), range_of(0.5 * (low + high))), (range, range));
            assert!(range + 1 == RANGES || bounds(range + 1)[0].to_bits() == high.to_bits());
        }
        assert_eq!([1.0, 1.1, f64::NAN, -0.1].map(range_of), [RANGES - 1, RANGES - 1, 0, 0]);
    }
}
