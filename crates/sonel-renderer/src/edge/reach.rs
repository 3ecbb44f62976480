//! Which edges are near a mirrored path.
//!
//! What an edge does to a path that it neither cuts off nor nearly does falls with the Fresnel number of the way over it, so how far edges
//! count grows with the wavelength; but no farther than that few count at once, since each sends as if the others were not there, and their sum
//! would grow with their number. What they send fades to nothing up to there, so that no edge begins at once.

use std::f64::consts::TAU;

use glam::DVec3;
use sonel_diffraction::wedge::apex;
use sonel_diffraction::{WAVES, WedgePoint};

use super::chain::Chain;
use super::family::{excess, turn};
use super::sight::{beyond_straight, smooth};
use super::world::RoomEdge;

/// How much longer [m] ways over edges are that count at any wavelength.
const LEAST: f64 = 0.1;
/// How many wavelengths more.
const WAVELENGTHS: f64 = 0.02;
/// The share of that up to which they count whole.
const WHOLE: f64 = 0.25;

/// How far edges count beside the path that a chain of mirrors shows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    order: u32,
}

impl Reach {
    /// Beside the path that `chain` shows.
    #[must_use]
    pub fn of(chain: &Chain) -> Self {
        Self { order: chain.order() }
    }

    /// Whether images of the path in the faces of edges are followed: where they are of three reflections nobody knows which of them are lit.
    #[must_use]
    pub fn has_faces(self) -> bool {
        self.order < 2
    }

    /// How much longer than the straight way [m] ways over edges are that count no more at wave number `k` [1/m].
    #[must_use]
    pub fn end(k: f64) -> f64 {
        LEAST + WAVELENGTHS * TAU / k
    }

    /// What counts at wave number `k` [1/m] of a wave over an edge that goes so much farther than straight on [m].
    #[must_use]
    pub fn share(excess: f64, k: f64) -> f64 {
        smooth((1.0 - excess / Self::end(k)) / (1.0 - WHOLE))
    }

    /// Whether anything counts of what an edge sends between two places at any wave number from `smallest_k` [1/m] on.
    #[must_use]
    pub fn holds(self, edge: &RoomEdge, [from, to]: [DVec3; 2], smallest_k: f64) -> bool {
        let end = Self::end(smallest_k);
        if beyond_straight(&edge.wedge, from, to) < end {
            return true;
        }
        let is_in_face = || match [from, to].map(|end| edge.wedge.locate(end)) {
            [Some(source), Some(receiver)] => {
                self.excesses(edge, source, receiver).iter().any(|&excess| excess < end)
            }
            _ => false,
        };
        self.has_faces() && is_in_face()
    }

    /// How much farther than straight on [m] each wave of an edge goes over it: that of the path, and its images in the faces; infinite for
    /// those that are not followed.
    #[must_use]
    pub fn excesses(self, edge: &RoomEdge, source: WedgePoint, receiver: WedgePoint) -> [f64; WAVES] {
        let way = apex(source, receiver).clamp(0.0, edge.wedge.length());
        let to = |point: WedgePoint| libm::hypot(point.radius, way - point.along);
        let shortest = libm::hypot(source.radius + receiver.radius, receiver.along - source.along);
        let beside = to(source) + to(receiver) - shortest;
        let of = |turn: f64| beside + excess(source, receiver, turn);
        let of_face =
            |face| if self.has_faces() { of(turn(edge, source, receiver, face)) } else { f64::INFINITY };
        [of((source.angle - receiver.angle).abs()), of_face(0), of_face(1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_count_whole_nearby_and_not_at_all_from_the_end_of_the_reach_on() {
        for k in [1.0, 10.0, 100.0] {
            let end = Reach::end(k);
            let shares = [0.0, 0.25, 0.5, 0.999, 1.0, 2.0].map(|part| Reach::share(part * end, k));
            assert!(shares[0] >= 1.0 && shares[1] >= 1.0 - 1e-12, "{shares:?}");
            assert!(
                shares[2] < 1.0 && shares[3] < 1e-4 && shares[4] <= 0.0 && shares[5] <= 0.0,
                "{shares:?}"
            );
        }
        assert!(Reach::end(1.0) > Reach::end(10.0), "farther the longer the waves");
    }
}
