//! Independent random streams, keyed by what they are for.
//!
//! A stream is ChaCha8 with the key (seed, purpose, owner) and the stream number of one emission or ray, so a result
//! depends neither on threads nor on the order in which packets are traced. The map from bits to floats is our own:
//! that of the `rand` crate may change with its version.
//!
//! Reference: [Bernstein2008] for ChaCha (docs/references.md).

use rand::rngs::ChaCha8Rng;
use rand::{Rng, SeedableRng};

/// Purpose of a family of streams; families never share a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Purpose {
    /// The life of one emitted packet after its emission.
    Packet = 1,
    /// Scrambling of the emission directions of one batch.
    EmissionScramble = 2,
    /// Visibility rays of one receiver.
    VisibilityRay = 3,
    /// Choices among the mirror images of one receiver.
    MirrorChoice = 4,
    /// Points of the Fresnel zones of one receiver.
    ZonePoint = 5,
    /// Rays of one source that every surface mirrors.
    SpecularRay = 7,
    /// Choice of the sonels of one source that reach for receivers.
    SonelChoice = 8,
    /// Plane waves of impulse responses.
    Pulse = 9,
    /// Directions about a specular path to one receiver.
    SpecularTrial = 10,
    /// Flights between the walls about a receiver.
    BoundaryFlight = 11,
}

/// All streams of one purpose and owner (a source index, the bits of a receiver position): a key without a number.
#[derive(Debug, Clone, Copy)]
pub struct StreamFamily {
    key: [u8; 32],
}

impl StreamFamily {
    /// The family of `purpose` for `owner` under the run's `seed`.
    #[must_use]
    pub fn new(seed: u64, purpose: Purpose, owner: [u32; 4]) -> Self {
        let mut key = [0_u8; 32];
        key[0..8].copy_from_slice(&seed.to_le_bytes());
        key[8..12].copy_from_slice(&(purpose as u32).to_le_bytes());
        for (slot, word) in key[12..28].chunks_exact_mut(4).zip(owner) {
            slot.copy_from_slice(&word.to_le_bytes());
        }
        Self { key }
    }

    /// The stream of member `number` (an emission index, a ray index), at its beginning.
    #[must_use]
    pub fn stream(&self, number: u64) -> Stream {
        let mut generator = ChaCha8Rng::from_seed(self.key);
        generator.set_stream(number);
        Stream { generator }
    }
}

/// One stream of uniform numbers.
#[derive(Debug)]
pub struct Stream {
    generator: ChaCha8Rng,
}

impl Stream {
    /// 32 uniform bits.
    #[inline]
    pub fn bits(&mut self) -> u32 {
        self.generator.next_u32()
    }

    /// A uniform number in [0, 1) with 24 bits: enough for a direction.
    #[inline]
    pub fn uniform(&mut self) -> f32 {
        unit_f32(self.bits())
    }

    /// Two uniform numbers in [0, 1), drawn in this order.
    #[inline]
    pub fn uniform_pair(&mut self) -> [f32; 2] {
        [self.uniform(), self.uniform()]
    }

    /// A uniform number in [0, 1) with 53 bits: for decisions, whose probabilities may be tiny.
    #[inline]
    pub fn uniform_fine(&mut self) -> f64 {
        unit_f64(self.generator.next_u64())
    }
}

/// The upper 24 bits as a number in [0, 1): every value is exact and 1 is never reached.
#[inline]
#[must_use]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1_u32 << 24) as f32)
}

/// The upper 53 bits as a number in [0, 1).
#[inline]
#[must_use]
pub fn unit_f64(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pinned: a change of any dependency that moves these numbers changes every published result.
    #[test]
    fn first_numbers_are_pinned() {
        let mut stream = StreamFamily::new(1, Purpose::Packet, [0; 4]).stream(0);
        let drawn = [stream.bits(), stream.bits(), stream.bits()];
        assert_eq!(drawn, PINNED);
    }

    const PINNED: [u32; 3] = [1_489_600_331, 1_011_583_306, 2_319_271_736];

    #[test]
    fn streams_of_different_number_purpose_owner_and_seed_differ() {
        let first =
            |seed, purpose, owner, number| StreamFamily::new(seed, purpose, owner).stream(number).bits();
        let base = first(1, Purpose::Packet, [0; 4], 0);
        assert_eq!(base, first(1, Purpose::Packet, [0; 4], 0));
        assert_ne!(base, first(2, Purpose::Packet, [0; 4], 0));
        assert_ne!(base, first(1, Purpose::VisibilityRay, [0; 4], 0));
        assert_ne!(base, first(1, Purpose::Packet, [0, 0, 0, 1], 0));
        assert_ne!(base, first(1, Purpose::Packet, [0; 4], 1));
    }

    #[test]
    fn unit_floats_cover_the_half_open_interval() {
        assert_eq!(unit_f32(0).to_bits(), 0.0_f32.to_bits());
        assert!(unit_f32(u32::MAX) < 1.0);
        assert_eq!(unit_f64(0).to_bits(), 0.0_f64.to_bits());
        assert!(unit_f64(u64::MAX) < 1.0);
    }
}
