//! Two edges apart against the sum of all pairs of their secondary sources, across the boundaries of both, and exchanged.

use super::*;
use glam::dvec3;
use sonel_testkit::analytic::double_edge::DoubleEdge;

const K: f64 = 6.0;
const APART: f64 = 2.0;

/// Two edges, the source on the side of the first and the receiver on that of the second.
struct Pair {
    wedges: [Wedge; 2],
    ends: [DVec3; 2],
    shares: [f64; 2],
}

/// Upright screens below rims of these lengths [m] along z.
fn screens(lengths: [f64; 2]) -> [Wedge; 2] {
    let screen = |(x, length): (f64, f64)| {
        let ends = [-0.5, 0.5].map(|share| dvec3(x, 0.0, share * length));
        Wedge::new(ends, -DVec3::Y, -DVec3::X, TAU).unwrap()
    };
    [(0.0, lengths[0]), (APART, lengths[1])].map(screen)
}

fn endless() -> [Wedge; 2] {
    screens([2e4; 2])
}

/// The left one of two boxes ends in its right upper edge, the right one begins with its left upper edge, somewhat higher.
fn boxes() -> [Wedge; 2] {
    let edge = |x: f64, y: f64, inward| {
        let ends = [-1e4, 1e4].map(|z| dvec3(x, y, z));
        Wedge::new(ends, inward, DVec3::Y, 1.5 * PI).unwrap()
    };
    [edge(0.0, 0.0, -DVec3::X), edge(APART, 0.3, DVec3::X)]
}

/// All of an edge, with the face to the edge beyond it, if there is one.
fn whole(wedge: &Wedge, at_second: bool) -> FaceEdge<'_> {
    FaceEdge { wedge, at_second: [at_second; 2], part: [0.0, wedge.length()], outline: &[] }
}

impl Pair {
    /// Stretches of the other edge that an end sees past its own.
    fn past(&self, of: usize) -> Vec<[f64; 2]> {
        let (wedge, other, end) = (&self.wedges[of], &self.wedges[1 - of], self.ends[of]);
        let [to, from] = [end, other.at(0.0)].map(|point| wedge.locate(point).unwrap());
        if turns(wedge, from, to)[0] < PI {
            return vec![[0.0, other.length()]];
        }
        let shadow = [0.0, wedge.length()].map(|along| {
            let place = end + (wedge.at(along) - end) * ((from.radius + to.radius) / to.radius);
            other.locate(place).unwrap().along.clamp(0.0, other.length())
        });
        let [low, high] = [shadow[0].min(shadow[1]), shadow[0].max(shadow[1])];
        let stretches = [[0.0, low], [high, other.length()]];
        stretches.into_iter().filter(|[from, to]| to > from).collect()
    }

    fn over_both(&self, k: f64) -> Complex {
        let past: [&dyn Fn() -> Vec<[f64; 2]>; 2] = [&|| self.past(0), &|| self.past(1)];
        let sides = [0, 1].map(|of| Side {
            edge: whole(&self.wedges[of], false),
            beyond: None,
            end: End { point: self.wedges[of].locate(self.ends[of]).unwrap(), before: true },
            view: View { within: 1e-8, past: past[of], in_face: &|_, _| None },
            share: self.shares[of],
        });
        let Some(path) = ApartPath::new(sides, 1.0) else { return Complex::ZERO };
        path.products(&k.into()).into_iter().fold(
            Complex::ZERO,
            |sum, Products { length, amplitudes, .. }| {
                let turn = Complex::unit(-k * length);
                amplitudes.into_iter().flatten().flatten().fold(sum, |sum, term| sum + term * turn)
            },
        )
    }

    /// Over the stretches of the first edge that the receiver sees past the second, and over those of the second that the source sees.
    fn over_one(&self, k: f64) -> Complex {
        [0, 1].into_iter().fold(Complex::ZERO, |sum, of| {
            let wedge = &self.wedges[of];
            let [source, receiver] = self.ends.map(|end| wedge.locate(end).unwrap());
            self.past(1 - of).into_iter().fold(sum, |sum, part| {
                let path = EdgePath::new(wedge, source, receiver, part, Lit::default(), 1.0);
                path.field(k).into_iter().fold(sum, |sum, term| sum + term)
            })
        })
    }

    fn of_parts(&self, k: f64) -> Complex {
        let [first, last] = &self.wedges;
        let about = |wedge: &Wedge, point: DVec3| {
            let at = wedge.locate(point).unwrap();
            (at.radius, at.angle, at.along)
        };
        let parts = DoubleEdge {
            angles: self.wedges.map(|wedge| wedge.angle()),
            joints: [about(first, last.at(0.0)).1, about(last, first.at(0.0)).1],
            source: about(first, self.ends[0]),
            receiver: about(last, self.ends[1]),
            width: about(first, last.at(0.0)).0,
        };
        let (re, im) = parts.pressure(k);
        Complex::new(re, im)
    }
}

/// Every point of the first edge lights every point of the second: a product of two fields says the same, less what the first field changes
/// along the second edge. No end is near a boundary, where the sum would need points without end. Half of it, as along a face, is rejected.
#[test]
fn two_edges_apart_are_the_sum_of_their_parts() {
    let beside = [
        [dvec3(-3.0, -2.0, 0.0), dvec3(APART + 2.0, -2.0, 1.0)],
        [dvec3(-3.0, -1.0, 0.0), dvec3(APART + 2.0, 0.8, 1.0)],
        [dvec3(-3.0, 0.5, 0.0), dvec3(APART + 2.0, -0.6, 1.0)],
        [dvec3(-3.0, 0.5, 0.0), dvec3(APART + 0.3, 0.7, 1.0)],
    ];
    let above = [
        [dvec3(-3.0, 1.5, 0.0), dvec3(APART + 2.0, 1.5, 1.0)],
        [dvec3(-1.0, 2.0, 0.0), dvec3(APART + 1.0, 1.2, 0.0)],
        [dvec3(-3.0, 3.0, 0.0), dvec3(APART + 2.0, 1.8, 1.0)],
        [dvec3(-1.0, 0.8, 0.0), dvec3(APART + 0.3, 1.0, 1.0)],
    ];
    for (wedges, all_ends) in [(endless(), beside), (boxes(), above)] {
        for k in [2.0, K] {
            let (mut errors, mut all) = ([0.0; 2], 0.0);
            for ends in all_ends {
                let pair = Pair { wedges, ends, shares: [1.0; 2] };
                let (found, exact) = (pair.over_both(k), pair.of_parts(k));
                for (sum, share) in errors.iter_mut().zip([1.0, 0.5]) {
                    *sum += (found * share - exact).square_of_modulus();
                }
                all += exact.square_of_modulus();
            }
            let [error, half] = errors.map(|error: f64| (error / all).sqrt());
            assert!(error < 0.1 && half > 0.4, "k {k}: {error}, {half}");
        }
    }
}

/// A receiver that rises out of the shadow of the second edge, on the boundary itself and beside it, where the edges are as long as one
/// another, and where the second hides but a part of the first; and a source.
#[test]
fn no_boundary_is_heard() {
    for lengths in [[2e4; 2], [5.0, 5.0], [5.0, 1.0], [1.0, 5.0]] {
        let source = dvec3(-3.0, -1.0, 0.3);
        let mut alone = 0.0f64;
        for (receiver, exchanged) in [0.1, 1.0, 4.0].into_iter().flat_map(|x| {
            let place = dvec3(APART + x, 0.0, 0.1);
            [(place, false), (place, true)]
        }) {
            let heard = |height: f64| {
                let mut pair = Pair {
                    wedges: screens(lengths),
                    ends: [source, receiver + height * DVec3::Y],
                    shares: [0.3, 1.0],
                };
                if exchanged {
                    pair.wedges.reverse();
                    pair.ends.reverse();
                    pair.shares.reverse();
                }
                [pair.over_one(K), pair.over_one(K) + pair.over_both(K)]
            };
            let places = [-1e-7, 0.0, 1e-7].map(heard);
            let step = |of: usize| {
                let steps = [0, 1].map(|at| (places[at][of] - places[at + 1][of]).modulus());
                steps[0].max(steps[1]) / places[1][1].modulus()
            };
            assert!(step(1) < 1e-3, "{lengths:?} {receiver} {exchanged}: {}", step(1));
            alone = alone.max(step(0));
        }
        if lengths[1] >= lengths[0] {
            assert!(alone > 0.1, "what begins at once without: {alone}");
        }
    }
}

#[test]
fn exchange_of_source_and_receiver_changes_nothing() {
    for wedges in [endless(), boxes(), screens([3.0, 0.7])] {
        for receiver in [dvec3(3.0, 0.5, 1.9), dvec3(2.01, 2.0, 0.5), dvec3(3.0, -0.01, 0.0)] {
            let ends = [dvec3(-2.0, 0.4, 0.2), receiver];
            let there = Pair { wedges, ends, shares: [1.0; 2] };
            let back = Pair { wedges: [wedges[1], wedges[0]], ends: [ends[1], ends[0]], shares: [1.0; 2] };
            if wedges[1].locate(receiver).is_some() {
                let (there, back) = (there.over_both(K), back.over_both(K));
                assert!((there - back).modulus() <= 1e-12 * there.modulus(), "{there:?} {back:?}");
            }
        }
    }
}

#[test]
fn every_field_is_finite() {
    let places = [
        DVec3::ZERO,
        dvec3(0.0, 0.0, 9.0),
        dvec3(APART, 0.0, 0.0),
        dvec3(APART, 0.0, 9.0),
        dvec3(APART, -1.0, 0.0),
        dvec3(-3.0, 0.0, 0.0),
        dvec3(5.0, 0.0, 0.0),
    ];
    for ends in places.into_iter().flat_map(|source| places.map(|receiver| [source, receiver])) {
        for wedges in [screens([3.0, 0.7]), endless()] {
            let field = Pair { wedges, ends, shares: [1.0; 2] }.over_both(K);
            assert!(field.modulus().is_finite(), "{ends:?}");
        }
    }
}
