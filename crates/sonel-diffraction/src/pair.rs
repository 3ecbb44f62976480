//! Diffraction over two edges that do not border one face: source, edge, air, edge, receiver.
//!
//! With the way unfolded into a straight line of length L = |S′R′|, each edge as if the other one were not there,
//!
//!   C = D₁(S → R′) D₂(S′ → R) L e^(jkL),
//!
//! R′ on the ray from the first edge through the second one, as far as R, and S′ likewise. Sound that comes from the edge before is more curved
//! than that from afar: what it changes is in `transition`, of the fields of either edge with the other one in the place of the end, and
//!
//! γ⁻² = 1 − ρ², ρ the correlation cos ψ √(|SP||QR|/(|SQ||PR|)) of the clearances from two edges at an angle ψ across the way. On the boundary of
//! either edge the product is exact at the other one, so that nothing steps where one edge hides the other.
//!
//! Reference: [Svensson1999] for the parts (docs/diffraction.md).

use glam::DVec3;

use crate::complex::{Complex, unit};
use crate::edge_path::{EdgePath, Visibility, WAVES};
use crate::transition::{Transition, share_beside};
use crate::wave_numbers::WaveNumbers;
use crate::wedge::{Wedge, WedgePoint, apex};

/// Rounds in which the shortest way over two edges is found; each halves its error at least.
const ROUNDS: usize = 64;
/// Least distance of two places that are not one [m]; it keeps quotients finite.
const SHORTEST: f64 = 1e-4;
/// An edge of which the part between two places [m from its start] counts.
#[derive(Debug, Clone, Copy)]
pub struct PartOfEdge<'a> {
    /// The edge.
    pub wedge: &'a Wedge,
    /// The part.
    pub part: [f64; 2],
}

/// The shortest way over two edges.
#[derive(Debug, Clone, Copy)]
pub struct PairWay {
    /// Where it crosses the edges [m from their starts].
    pub crossings: [f64; 2],
    /// The same places [m].
    pub places: [DVec3; 2],
    /// Lengths of its three legs [m].
    pub legs: [f64; 3],
    /// The other end of the way over each edge, where the way over the other edge is unfolded [m].
    pub unfolded: [DVec3; 2],
}

impl PairWay {
    /// The shortest way between two `ends` [m]; none where an edge is behind the other one.
    #[must_use]
    pub fn new(edges: [PartOfEdge<'_>; 2], ends: [DVec3; 2]) -> Option<Self> {
        let points = [0, 1].map(|i| edges[i].wedge.locate(ends[i]));
        let [Some(source), Some(receiver)] = points else { return None };
        let mut crossings = edges.map(|edge| 0.5 * (edge.part[0] + edge.part[1]));
        for round in 0..ROUNDS {
            let before = crossings;
            let there = edges[0].wedge.along_and_radius(edges[1].wedge.at(crossings[1]));
            crossings[0] = apex(source, there).clamp(edges[0].part[0], edges[0].part[1]);
            let back = edges[1].wedge.along_and_radius(edges[0].wedge.at(crossings[0]));
            crossings[1] = apex(back, receiver).clamp(edges[1].part[0], edges[1].part[1]);
            if round > 0 && (crossings[0] - before[0]).abs() + (crossings[1] - before[1]).abs() < 1e-9 {
                break;
            }
        }
        let places = [0, 1].map(|i| edges[i].wedge.at(crossings[i]));
        let legs = [
            ends[0].distance(places[0]),
            places[0].distance(places[1]).max(SHORTEST),
            places[1].distance(ends[1]),
        ];
        let ahead = (places[1] - places[0]).try_normalize()?;
        let unfolded = [places[0] + ahead * (legs[1] + legs[2]), places[1] - ahead * (legs[1] + legs[0])];
        Some(Self { crossings, places, legs, unfolded })
    }

    /// Its length [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.legs.iter().sum()
    }
}

/// A path over two edges.
#[derive(Debug, Clone)]
pub struct EdgePair {
    length: f64,
    /// Either edge as if the other one were not there.
    alone: [EdgePath; 2],
    transitions: Option<[Transition; 2]>,
    points: [[WedgePoint; 2]; 2],
}

impl EdgePair {
    /// The path between two `ends` [m] along `way`; none where an edge is behind the other one.
    #[must_use]
    pub fn new(edges: [PartOfEdge<'_>; 2], ends: [DVec3; 2], way: &PairWay, range: [f64; 2]) -> Option<Self> {
        let [first, last] = edges;
        let [p, q] = way.places;
        let [before, apart, behind] = way.legs;
        let ahead = (q - p).try_normalize()?;
        let unfolded = way.unfolded;
        let source = first.wedge.locate(ends[0])?;
        let receiver = last.wedge.locate(ends[1])?;
        let beyond = first.wedge.locate(unfolded[0])?;
        let afar = last.wedge.locate(unfolded[1])?;
        let lit = Visibility::default();
        let path =
            |edge: PartOfEdge<'_>, from, to| EdgePath::new(edge.wedge, from, to, edge.part, lit, range);
        let alone = [path(first, source, beyond), path(last, afar, receiver)];
        let across = [first, last].map(|edge| {
            let direction = edge.wedge.direction();
            (direction - ahead * direction.dot(ahead)).normalize_or_zero()
        });
        let cosine = across[0].dot(across[1]);
        let square = cosine * cosine * before * behind / ((before + apart) * (apart + behind));
        let gamma = 1.0 / (1.0 - square).max(1e-6).sqrt();
        let length = way.length();
        let transition = |edge: PartOfEdge<'_>, [near, far]: [WedgePoint; 2], end, reach: f64| {
            let endless = |from| EdgePath::endless(edge.wedge.angle(), [from, end], lit, range);
            Transition { near: endless(near), far: endless(far), shorter: reach / length, most: gamma }
        };
        let near = [first.wedge.locate(q)?, last.wedge.locate(p)?];
        let transitions = (gamma > 1.0 + 1e-3).then(|| {
            [
                transition(first, [near[0], beyond], source, before + apart),
                transition(last, [near[1], afar], receiver, apart + behind),
            ]
        });
        Some(Self { length, alone, transitions, points: [[source, beyond], [afar, receiver]] })
    }

    /// Amplitudes at every wave number of the waves of the first edge by those of the last one, to be multiplied by e^(−jk length) [1/m].
    #[must_use]
    pub fn amplitudes(&self, numbers: &WaveNumbers) -> Vec<[[Complex; WAVES]; WAVES]> {
        let light = self.light(numbers);
        let [first, last] = [0, 1].map(|edge| self.alone[edge].fields(numbers));
        let both = first.iter().zip(&last).zip(numbers.values()).zip(light);
        both.map(|(((first, last), k), light)| {
            // Each of the fields turns over the whole way.
            let factor = unit(2.0 * k * self.length) * light * self.length;
            first.map(|one| last.map(|other| one * other * factor))
        })
        .collect()
    }

    /// Of every wave number, what it is over C.
    fn light(&self, numbers: &WaveNumbers) -> Vec<Complex> {
        let one = Complex::from(1.0);
        let Some(transitions) = &self.transitions else { return vec![one; numbers.values().len()] };
        let [first, last] = transitions.each_ref().map(|transition| transition.shares(numbers));
        let most = transitions[0].most;
        first
            .into_iter()
            .zip(last)
            .map(|(p, q)| one + p * share_beside([p, q], most) * (most - 1.0))
            .collect()
    }

    /// The ends of the path over either edge about it.
    #[must_use]
    pub fn points(&self) -> [[WedgePoint; 2]; 2] {
        self.points
    }

    /// Length of the way [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }
}
