//! L S^k R beyond the mirror chains, and … D S⁺ R: traced segments that cross a sphere about the receiver.
//!
//! fluence += e / (π r²), at the time of the closest approach. The sphere holds no surface, so a segment through it is
//! seen whole; the bias is that of averaging over the sphere, O(r²) (docs/physics.md §4).

use sonel_map::{Lanes, Segment, SegmentHistory};

use crate::air::AirTable;
use crate::deposit::{Deposits, TimeBins};
use crate::receiver::PreparedReceiver;

/// Whether a segment with `history` is owned by the sphere, given the order K of the mirror chains.
#[inline]
#[must_use]
pub fn owns(history: SegmentHistory, mirror_order: u32) -> bool {
    if history.diffused { history.specular_run > 0 } else { history.specular_run > mirror_order }
}

/// Adds what `segment` brings to every receiver's sphere.
#[inline]
pub fn cross(
    segment: &Segment<'_>,
    receivers: &[PreparedReceiver],
    surroundings: (&TimeBins, Option<&AirTable>),
    scratch: &mut [Lanes],
    deposits: &mut Deposits,
) {
    let (bins, air) = surroundings;
    let along = (segment.end - segment.start).as_dvec3();
    let extent = along.length();
    if extent <= 0.0 {
        return;
    }
    let direction = along / extent;
    for (index, receiver) in receivers.iter().enumerate() {
        let offset = receiver.exact - segment.start.as_dvec3();
        let travelled = offset.dot(direction);
        let squared = receiver.radius * receiver.radius;
        // The point of closest approach decides to which segment a crossing belongs, so none counts twice.
        if travelled <= 0.0 || travelled >= extent || offset.length_squared() - travelled * travelled > squared {
            continue;
        }
        let length = segment.start_length + travelled;
        let Some(bin) = bins.bin(length) else { continue };
        let fluence = 1.0 / (core::f64::consts::PI * squared);
        for (scratch, energy) in scratch.iter_mut().zip(segment.energy) {
            for lane in 0..4 {
                scratch[lane] = energy[lane] * fluence;
            }
        }
        if let Some(air) = air {
            air.attenuate(length, scratch);
        }
        deposits.add(index, bin, scratch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_history_has_one_owner() {
        let history = |specular_run, diffused| SegmentHistory { order: 9, specular_run, diffused };
        assert!(!owns(history(0, false), 2), "direct sound");
        assert!(!owns(history(2, false), 2), "mirror chain");
        assert!(owns(history(3, false), 2));
        assert!(!owns(history(0, true), 2), "connection");
        assert!(owns(history(1, true), 2));
    }
}
