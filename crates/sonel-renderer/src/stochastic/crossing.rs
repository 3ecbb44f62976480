//! … D S^k R, k > K′, and L S^k R, k > K, where `specular` does not own it: traced segments that cross the ball about a receiver
//! ([`crate::ball`]).
//!
//! fluence += e ℓ / V, at the time at which the segment's line passes the receiver, but not before the direct sound. The bias is that of
//! averaging over the ball (docs/physics.md §4).

use glam::Vec3;
use sonel_map::{BandValues, Lanes, Segment, SegmentHistory};

use crate::ball::BeamKind;
use crate::receiver::PreparedReceiver;
use crate::stochastic::estimate::{Arriving, Deposit};

/// Path classes of reflected sound that other estimators bring to one receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AssignedClasses {
    /// Image-source paths: the largest cost of their chains.
    pub mirror_limit: u32,
    /// Whether the late specular rays bring longer specular paths.
    pub specular_rays: bool,
    /// Mirror images of the receiver: the largest cost of their chains.
    pub image_limit: u32,
    /// Whether connections bring … D R.
    pub diffuse: bool,
}

/// Whether a segment with `history`, whose mirrors since the last diffuse reflection cost `run`, is left to the sphere. Direct sound never is; what passed an interface since its last diffuse reflection,
/// or since the source, always is, since no straight way leads there, and so is what came back from one after a diffuse reflection.
#[inline]
#[must_use]
pub(crate) fn is_left_to_sphere(history: SegmentHistory, run: u32, others: AssignedClasses) -> bool {
    if history.image_order().is_some() {
        return run + history.interfaces > others.mirror_limit && !others.specular_rays;
    }
    match (history.interfaces, history.specular_run) {
        (0, 0) => !others.diffuse,
        (0, _) => run > others.image_limit,
        _ => true,
    }
}

/// A straight piece of a way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WayPiece<'a> {
    /// Ends, relative to the scene's centre [m].
    pub ends: (Vec3, Vec3),
    /// Path length from the source to its beginning [m].
    pub start_length: f64,
    /// Energy on it, without air [1].
    pub energy: &'a [Lanes],
    /// Path length from which on the receiver's air has still to take its part, where the scene has several [m].
    pub fades_from: f64,
    /// Kind of the path for a ball.
    pub beam: BeamKind,
}

impl<'a> WayPiece<'a> {
    /// The whole of `segment`.
    #[must_use]
    pub(crate) fn of(segment: &Segment<'a>) -> Self {
        let ends = (segment.start, segment.end);
        let start_length = segment.start_length;
        let is_refracted = segment.history.interfaces > 0 && !segment.history.diffused;
        let beam = if is_refracted { BeamKind::Refracted } else { BeamKind::Diffused };
        Self { ends, start_length, energy: segment.energy, fades_from: start_length, beam }
    }
}

/// Adds what `piece` brings to the balls of `receivers`, each with its number and the length of the straight way from the source, see
/// [`crate::straight_length`] [m].
#[inline]
pub(crate) fn cross<'a>(
    piece: &WayPiece<'_>,
    receivers: impl Iterator<Item = (usize, &'a PreparedReceiver, f64)>,
    scratch: &mut [Lanes],
    deposit: &mut Deposit<'_, '_>,
) {
    let medium = deposit.medium;
    // Others come from everywhere, and the strongest of them is near.
    let is_beam = piece.beam != BeamKind::Diffused;
    for (index, receiver, direct_length) in receivers {
        let ball = receiver.balls.at(piece.start_length, piece.beam);
        let Some(chord) = ball.chord(medium.geometry, piece.ends) else {
            let is_near = || ball.is_passed_nearby(medium.geometry, piece.ends);
            if is_beam {
                deposit.estimate.crossings.pass_near(piece.beam, index, piece.energy, is_near);
            }
            continue;
        };
        let along = (piece.ends.1 - piece.ends.0).as_dvec3();
        let fluence = chord.fluence * receiver.sensitivity.to(-along);
        let length = (piece.start_length + chord.at * receiver.stretch).max(direct_length);
        let Some(bin) = medium.bins.bin(length) else { continue };
        deposit.estimate.crossings.cross(piece.beam, index, piece.energy);
        scratch.set_times(piece.energy, fluence);
        medium.receive(receiver, (length - piece.fades_from).max(0.0), scratch);
        let arriving = Arriving { receiver: index, towards: -along, length, bin };
        deposit.add_from_kernel(arriving, scratch, chord.gain);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_history_has_one_owner() {
        let history = |specular_run, diffused| SegmentHistory {
            order: 9,
            specular_run,
            diffused,
            interfaces: 0,
            refractions: 0,
        };
        let is_left_to_sphere =
            |history: SegmentHistory, others| is_left_to_sphere(history, history.specular_run, others);
        let others = AssignedClasses { mirror_limit: 2, specular_rays: false, image_limit: 1, diffuse: true };
        assert!(!is_left_to_sphere(history(0, false), others), "direct sound");
        assert!(!is_left_to_sphere(history(2, false), others), "image-source path");
        assert!(is_left_to_sphere(history(3, false), others));
        assert!(!is_left_to_sphere(history(0, true), others), "connection");
        assert!(!is_left_to_sphere(history(1, true), others), "mirror connection");
        assert!(is_left_to_sphere(history(2, true), others));
        let mirrored = AssignedClasses { specular_rays: true, ..others };
        assert!(!is_left_to_sphere(history(3, false), mirrored));
        let alone = AssignedClasses { mirror_limit: 0, image_limit: 0, diffuse: false, ..others };
        assert!(!is_left_to_sphere(history(0, false), alone), "direct sound");
        for (run, diffused) in [(0, false), (1, false), (0, true), (1, true)] {
            let refracted = SegmentHistory { interfaces: 1, refractions: 1, ..history(run, diffused) };
            assert!(
                is_left_to_sphere(refracted, others)
                    && is_left_to_sphere(refracted, mirrored)
                    && is_left_to_sphere(refracted, alone)
            );
        }
        let returned = |interfaces, diffused| SegmentHistory { interfaces, ..history(1, diffused) };
        assert!(!is_left_to_sphere(returned(1, false), others), "image source in an interface");
        assert!(
            is_left_to_sphere(returned(2, false), others) && is_left_to_sphere(returned(1, true), others)
        );
        assert!(
            is_left_to_sphere(history(1, false), alone)
                && is_left_to_sphere(history(0, true), alone)
                && is_left_to_sphere(history(1, true), alone)
        );
    }
}
