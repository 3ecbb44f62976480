//! L S^k R, k > K, and … D S^k R, k > K′: traced segments that cross a sphere about the receiver.
//!
//! fluence += e / (π r²), at the time of the closest approach. The sphere holds no surface, so a segment through it is
//! seen whole; the bias is that of averaging over the sphere, O(r²) (docs/physics.md §4).

use sonel_map::{Lanes, Segment, SegmentHistory};

use crate::connection::ClassDeposits;
use crate::receiver::PreparedReceiver;
use crate::render::Medium;

/// What other estimators own of the reflected sound at one receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OthersOwn {
    /// K: mirror chains from the source.
    pub mirror_order: u32,
    /// K′: mirror images of the receiver.
    pub image_order: u32,
    /// Whether connections own … D R.
    pub diffuse: bool,
    /// Whether visibility rays own what was bent behind its last diffuse reflection: else connections do where it was once and reached the
    /// receiver without a mirror, and the rest is left.
    pub bent: bool,
}

/// Whether a segment with `history` is left to the sphere. Direct sound never is.
#[inline]
#[must_use]
pub fn owns(history: SegmentHistory, others: OthersOwn) -> bool {
    match (history.diffused, history.specular_run) {
        (false, run) => run > others.mirror_order,
        (true, 0) => !others.diffuse || history.bends > 1 && !others.bent,
        (true, run) => run > others.image_order || history.bends > 0 && !others.bent,
    }
}

/// Adds what `segment` brings to the sphere of every receiver that leaves its class to spheres. `coarse` is the coarse bin of
/// a receiver's fine bin.
#[inline]
pub fn cross<'a>(
    segment: &Segment<'_>,
    receivers: impl Iterator<Item = (&'a PreparedReceiver, &'a OthersOwn)>,
    medium: &Medium<'_>,
    coarse: impl Fn(usize, usize) -> u32,
    scratch: &mut [Lanes],
    deposits: &mut ClassDeposits<'_>,
) {
    let along = (segment.end - segment.start).as_dvec3();
    let extent_squared = along.length_squared();
    for (index, (receiver, &others)) in receivers.enumerate() {
        if !owns(segment.history, others) {
            continue;
        }
        let offset = receiver.exact - segment.start.as_dvec3();
        let radius_squared = receiver.radius * receiver.radius;
        // Everything times the squared extent, so that a miss costs neither root nor division. The point of closest
        // approach decides to which segment a crossing belongs, so none counts twice.
        let projected = offset.dot(along);
        let miss_squared = offset.length_squared() * extent_squared - projected * projected;
        if projected <= 0.0 || projected >= extent_squared || miss_squared > radius_squared * extent_squared {
            continue;
        }
        let length = segment.start_length + projected / extent_squared.sqrt();
        let Some(bin) = medium.bins.bin(length) else { continue };
        let fluence = 1.0 / (core::f64::consts::PI * radius_squared);
        for (scratch, energy) in scratch.iter_mut().zip(segment.energy) {
            for lane in 0..4 {
                scratch[lane] = energy[lane] * fluence;
            }
        }
        let in_half = miss_squared <= 0.5 * radius_squared * extent_squared;
        let gain = if in_half { 2.0 } else { 0.0 };
        deposits.add_from_kernel(index, (bin, coarse(index, bin)), length, scratch, gain, medium);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_history_has_one_owner() {
        let bent = |specular_run, diffused, bends| SegmentHistory { order: 9, specular_run, diffused, bends };
        let history = |specular_run, diffused| bent(specular_run, diffused, 0);
        let others = OthersOwn { mirror_order: 2, image_order: 1, diffuse: true, bent: false };
        assert!(!owns(history(0, false), others), "direct sound");
        assert!(!owns(history(2, false), others), "mirror chain");
        assert!(owns(history(3, false), others));
        assert!(!owns(history(0, true), others), "connection");
        assert!(!owns(history(1, true), others), "mirror connection");
        assert!(owns(history(2, true), others));
        assert!(!owns(bent(0, true, 1), others), "connection over an edge");
        assert!(owns(bent(0, true, 2), others));
        assert!(owns(bent(1, true, 1), others), "images do not follow bends");
        assert!(!owns(bent(0, false, 1), others), "direct sound is left to the edges");
        let rays = OthersOwn { bent: true, ..others };
        assert!(!owns(bent(0, true, 2), rays) && !owns(bent(1, true, 1), rays), "visibility rays turn");
        assert!(owns(bent(2, true, 1), rays) && owns(bent(3, false, 1), rays));
        let alone = OthersOwn { mirror_order: 0, image_order: 0, diffuse: false, bent: false };
        assert!(!owns(history(0, false), alone), "direct sound");
        assert!(
            owns(history(1, false), alone) && owns(history(0, true), alone) && owns(history(1, true), alone)
        );
    }
}
