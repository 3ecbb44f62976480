//! Which edges are near a mirrored path.
//!
//! What an edge does to a path that it neither cuts off nor nearly does falls with the Fresnel number of the way over it, so how far edges
//! count grows with the wavelength; but no farther than that few count at once, since each sends as if the others were not there, and their sum
//! would grow with their number. What they send fades to nothing up to there, so that no edge begins at once.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use sonel_diffraction::wedge::apex;
use sonel_diffraction::{WAVES, WedgePoint};

use super::chain::Chain;
use super::family::{excess, turn};
use super::sight::{beyond_straight, smooth};
use super::world::RoomEdge;

/// How much longer [m] ways over edges are that count at any wavelength.
const LEAST: f64 = 0.02;
/// How many wavelengths more.
const WAVELENGTHS: f64 = 0.004;
/// The share of that up to which they count whole.
const WHOLE: f64 = 0.25;

/// How a wave passes an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beside {
    /// How much farther than straight on the way over the edge is [m].
    pub excess: f64,
    /// Whether the edge leaves the wave there and does not shade it.
    pub is_lit: bool,
}

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

    /// What counts at wave number `k` [1/m] of a wave over an edge.
    #[must_use]
    pub fn share(beside: Beside, k: f64) -> f64 {
        let end = if beside.is_lit { Self::lit_end(k) } else { Self::end(k) };
        smooth((1.0 - beside.excess / end) / (1.0 - WHOLE))
    }

    /// The same of [`Reach::end`] where the wave is lit. Next to its boundary a wave has lost there what it has won in its shadow and farther on
    /// in the light, where it exceeds 1. Of what counts as much must be lost as is won: a fit to half planes for Fresnel
    /// numbers of 0.01 … 5 at the end of the shadow.
    fn lit_end(k: f64) -> f64 {
        let end = Self::end(k);
        let number = end * k / PI;
        end * 0.08 / (1.0 + 3.1 * libm::pow(number, 0.75))
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
                self.beside(edge, source, receiver).iter().any(|beside| beside.excess < end)
            }
            _ => false,
        };
        self.has_faces() && is_in_face()
    }

    /// How each wave of an edge passes it: that of the path, and its images in the faces; infinitely far off those that are not followed.
    #[must_use]
    pub fn beside(self, edge: &RoomEdge, source: WedgePoint, receiver: WedgePoint) -> [Beside; WAVES] {
        let way = apex(source, receiver).clamp(0.0, edge.wedge.length());
        let to = |point: WedgePoint| libm::hypot(point.radius, way - point.along);
        let shortest = libm::hypot(source.radius + receiver.radius, receiver.along - source.along);
        let past_end = to(source) + to(receiver) - shortest;
        let of = |turn: f64| Beside { excess: past_end + excess(source, receiver, turn), is_lit: turn < PI };
        let unknown = Beside { excess: f64::INFINITY, is_lit: false };
        let of_face = |face| if self.has_faces() { of(turn(edge, source, receiver, face)) } else { unknown };
        [of((source.angle - receiver.angle).abs()), of_face(0), of_face(1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_diffraction::{Complex, EdgePath, Lit, Wedge};

    /// What counts of waves at this excess [m].
    fn share(excess: f64, is_lit: bool, k: f64) -> f64 {
        Reach::share(Beside { excess, is_lit }, k)
    }

    #[test]
    fn edges_count_whole_nearby_and_not_at_all_from_the_end_of_the_reach_on() {
        for k in [1.0, 10.0, 100.0] {
            for (is_lit, end) in [(false, Reach::end(k)), (true, Reach::lit_end(k))] {
                let shares = [0.0, 0.25, 0.5, 0.999, 1.0, 2.0].map(|part| share(part * end, is_lit, k));
                assert!(shares[0] >= 1.0 && shares[1] >= 1.0 - 1e-12, "{shares:?}");
                assert!(
                    shares[2] < 1.0 && shares[3] < 1e-4 && shares[4] <= 0.0 && shares[5] <= 0.0,
                    "{shares:?}"
                );
            }
            assert!(Reach::lit_end(k) < Reach::end(k));
        }
        assert!(Reach::end(1.0) > Reach::end(10.0), "farther the longer the waves");
    }

    /// Behind a half plane what the shadow wins is what the light next to it loses, all over the boundary: the field there is erfc(√(jkΔ))/2
    /// at an excess Δ, which grows as the square of the distance from the boundary.
    #[test]
    fn next_to_a_boundary_as_much_is_lost_as_is_won() {
        let ends = [-1000.0, 1000.0].map(|y| DVec3::Y * y);
        let wedge = Wedge::new(ends, DVec3::NEG_Z, DVec3::NEG_X, TAU).expect("a wedge");
        let point = |angle: f64| WedgePoint { radius: 10.0, angle, along: 1000.0 };
        for k in [1.2, 3.0, 10.0, 40.0, 80.0] {
            let [mut lost, mut won, mut lost_as_widely] = [0.0; 3];
            let widest = (2.0 * Reach::end(k) / 10.0).sqrt() * 2.2;
            for step in 0..400 {
                let aside = widest * (f64::from(step) + 0.5) / 400.0;
                // Of the source at a right angle to the screen, where its image is far from here.
                let field = |turn: f64| {
                    let (source, receiver) = (point(0.5 * PI), point(0.5 * PI + turn));
                    let path = EdgePath::new(&wedge, source, receiver, [0.0, 2000.0], Lit::default(), k);
                    let straight = 20.0 * libm::cos(0.5 * aside);
                    let sent = path.field(k)[0] * Complex::unit(k * straight) * straight;
                    (sent, path.detour() - straight)
                };
                let ((lit, excess), (dark, _)) = (field(PI - aside), field(PI + aside));
                let loss = |share: f64| 1.0 - (Complex::real(1.0) + lit * share).square_of_modulus();
                lost += loss(share(excess, true, k));
                lost_as_widely += loss(share(excess, false, k));
                won += (dark * share(excess, false, k)).square_of_modulus();
            }
            assert!((lost / won - 1.0).abs() < 0.15, "{k}: {lost} lost, {won} won");
            assert!(lost_as_widely > 1.5 * won, "{k}: {lost_as_widely} lost, {won} won");
        }
    }
}
