//! L S^k R, k > K, and … D S^k R, k > K′: traced segments that cross a sphere about the receiver.
//!
//! fluence += e / (π r²) in a sphere that holds no wall: a segment through it is seen whole. Next to walls the sphere is what is seen of it
//! from the receiver, of volume V, and a segment adds e l / V, l its length in there: a random place of its length in the whole sphere is
//! seen or not. The bias is that of averaging over the sphere, O(r²) (docs/physics.md §4), and of O(r) times what walls absorb where they
//! cut it.
//!
//! The time is that of the closest approach of the segment's line, but not before the direct sound.

use sonel_geometry::Departure;
use sonel_map::{Lanes, Segment, SegmentHistory};

use crate::connection::ClassDeposits;
use crate::receiver::{CutSphere, PreparedReceiver};
use crate::render::Medium;

/// What other estimators own of the reflected sound at one receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    /// Length of the straight way from the source [m].
    pub direct_length: f64,
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
/// a receiver's fine bin, `choice` a random number for a receiver.
#[inline]
pub fn cross<'a>(
    segment: &Segment<'_>,
    receivers: impl Iterator<Item = (&'a PreparedReceiver, &'a OthersOwn)>,
    medium: &Medium<'_>,
    coarse: impl Fn(usize, usize) -> u32,
    mut choice: impl FnMut(usize) -> f64,
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
        // Everything times the squared extent, so that a miss costs neither root nor division.
        let projected = offset.dot(along);
        let miss_squared = offset.length_squared() * extent_squared - projected * projected;
        if miss_squared > radius_squared * extent_squared {
            continue;
        }
        let found = match receiver.cut {
            // The point of closest approach decides to which segment a crossing belongs, so none counts twice.
            None if projected <= 0.0 || projected >= extent_squared => None,
            None => Some(Crossing {
                fluence: 1.0 / (core::f64::consts::PI * radius_squared),
                gain: if miss_squared <= 0.5 * radius_squared * extent_squared { 2.0 } else { 0.0 },
            }),
            Some(cut) => {
                let half =
                    ((radius_squared * extent_squared - miss_squared) / extent_squared).max(0.0).sqrt();
                let (middle, extent) = (projected / extent_squared.sqrt(), extent_squared.sqrt());
                let part = [(middle - half).max(0.0), (middle + half).min(extent)];
                (part[0] < part[1])
                    .then(|| Crossing::of_cut(segment, receiver, cut, medium, part, choice(index)))
                    .flatten()
            }
        };
        let Some(Crossing { fluence, gain }) = found else { continue };
        let length = (segment.start_length + projected / extent_squared.sqrt()).max(others.direct_length);
        let Some(bin) = medium.bins.bin(length) else { continue };
        for (scratch, energy) in scratch.iter_mut().zip(segment.energy) {
            for lane in 0..4 {
                scratch[lane] = energy[lane] * fluence;
            }
        }
        deposits.add_from_kernel(index, (bin, coarse(index, bin)), length, scratch, gain, medium);
    }
}

/// What a segment adds to a sphere.
struct Crossing {
    /// Per unit energy [1/m²].
    fluence: f64,
    /// How many times as much half the area finds.
    gain: f64,
}

impl Crossing {
    /// The crossing of the `part` of `segment` [m] that lies in a sphere cut by walls; [`None`] where the place drawn is hidden.
    fn of_cut(
        segment: &Segment<'_>,
        receiver: &PreparedReceiver,
        cut: CutSphere,
        medium: &Medium<'_>,
        [from, to]: [f64; 2],
        choice: f64,
    ) -> Option<Self> {
        let direction = (segment.end - segment.start).as_dvec3().normalize();
        let place = segment.start.as_dvec3() + (from + choice * (to - from)) * direction;
        if medium.geometry.is_blocked(Departure::free(receiver.position), place.as_vec3()) {
            return None;
        }
        let is_inner = place.distance_squared(receiver.exact) <= 0.5 * receiver.radius * receiver.radius;
        let gain = if is_inner { cut.volume / cut.inner_volume } else { 0.0 };
        Some(Self { fluence: (to - from) / cut.volume, gain })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_history_has_one_owner() {
        let bent = |specular_run, diffused, bends| SegmentHistory { order: 9, specular_run, diffused, bends };
        let history = |specular_run, diffused| bent(specular_run, diffused, 0);
        let others =
            OthersOwn { mirror_order: 2, image_order: 1, diffuse: true, bent: false, direct_length: 0.0 };
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
        let alone =
            OthersOwn { mirror_order: 0, image_order: 0, diffuse: false, bent: false, direct_length: 0.0 };
        assert!(!owns(history(0, false), alone), "direct sound");
        assert!(
            owns(history(1, false), alone) && owns(history(0, true), alone) && owns(history(1, true), alone)
        );
    }
}
