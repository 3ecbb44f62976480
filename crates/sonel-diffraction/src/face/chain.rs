//! Products of fields of first order, one an edge: each edge is lit by a point source on the edge before.
//!
//! A path over n edges is the mean of two forms. That of the receiver takes what arrives at R′ over the first n − 1 edges, exactly as it
//! would be heard there, past the last; that of the source is the same with both exchanged. Where the receiver crosses the plane before the
//! last edge the receiver's form has to be heard alone and whole, where the source crosses that behind the first the source's. Where
//! either edge comes into sight the path of most edges has to begin with nothing, since no longer one completes it.

use std::f64::consts::PI;

use super::narrow::Narrow;
use super::outline::stretches;
use super::{End, FaceEdge, Lead};
use crate::complex::Complex;
use crate::contour::Rule;
use crate::edge_path::{EdgePath, Lit, WAVES};
use crate::wave_numbers::WaveNumbers;
use crate::wedge::{Wedge, WedgePoint, apex};

/// P keeps this share of the length of its edge, and of the way, from the ends of the edge: what a corner sends comes from about it.
const OFF_THE_ENDS: f64 = 0.25;
/// tan ½θ of the angle over the face below which a second edge fades.
const FADED: f64 = 0.1;
/// Square of the share of one end's height over the plane that its edge comes into sight at, nearer than which the other end is to its own
/// plane where it hears its form whole nevertheless.
const NEAR: f64 = 0.1;
/// A path over so many edges is completed by no longer one.
const LAST: usize = 3;

/// What all paths are asked for with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    /// Angle from a plane [rad] within which [`End::before`] is believed.
    pub within: f64,
    pub smallest_k: f64,
    /// Nodes of the integrals.
    pub rule: &'static Rule,
    /// Whether a path fades where what is left out would cut it off.
    pub fades: bool,
}

impl Asked {
    fn path(self, wedge: &Wedge, from: WedgePoint, to: WedgePoint, part: [f64; 2], lit: Lit) -> EdgePath {
        EdgePath::by(self.rule, wedge, from, to, part, lit, self.smallest_k)
    }
}

/// Chains with a factor in common.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub chains: Vec<Chain>,
    narrow: Option<Narrow>,
}

/// A product of fields.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    pub lead: Lead,
    first: EdgePath,
    /// Those over the other edges, each over the parts of it that are seen from the one before.
    others: Vec<Vec<EdgePath>>,
    /// Sum [m] and product of all |P R′|.
    reaches: (f64, f64),
    /// Length of the shortest way [m].
    pub length: f64,
    weight: f64,
    /// What lights the edge it ends at, about that.
    from: WedgePoint,
}

impl Part {
    /// Amplitudes by chain and wave number, to be multiplied by e^(−jk length) [1/m].
    pub fn amplitudes(&self, numbers: &WaveNumbers, length: f64) -> Vec<Vec<[Complex; WAVES]>> {
        let mut amplitudes: Vec<_> =
            self.chains.iter().map(|chain| chain.amplitudes(numbers, length)).collect();
        let ratios = self.narrow.iter().flat_map(|narrow| narrow.ratios(numbers)).enumerate();
        for (index, ratio) in ratios {
            for of_chain in &mut amplitudes {
                of_chain[index] = of_chain[index].map(|term| term * ratio);
            }
        }
        amplitudes
    }
}

impl Chain {
    /// Over the only edge.
    fn new(edge: &FaceEdge<'_>, source: WedgePoint, receiver: WedgePoint, asked: Asked) -> Self {
        let first = asked.path(edge.wedge, source, receiver, edge.part, Lit::default());
        Self {
            lead: Lead { edge: 0, ends: [source, receiver] },
            others: Vec::new(),
            reaches: (0.0, 1.0),
            length: first.detour(),
            first,
            weight: 1.0,
            from: source,
        }
    }

    /// Amplitudes at every wave number by the wave that the leading edge completes, to be multiplied by e^(−jk length) [1/m].
    pub fn amplitudes(&self, numbers: &WaveNumbers, length: f64) -> Vec<[Complex; WAVES]> {
        let (sum, product) = self.reaches;
        let turn = |k: &f64| Complex::unit(k * (sum + length)) * (product * self.weight);
        let mut factors: Vec<Complex> = numbers.values().iter().map(turn).collect();
        for over in &self.others {
            let mut fields = vec![Complex::ZERO; factors.len()];
            for path in over {
                fields.iter_mut().zip(path.totals(numbers)).for_each(|(field, total)| *field += total);
            }
            factors.iter_mut().zip(fields).for_each(|(factor, field)| *factor = *factor * field);
        }
        let first = self.first.fields(numbers).into_iter();
        first.zip(factors).map(|(terms, factor)| terms.map(|term| term * factor)).collect()
    }
}

/// All that comes over `edges`.
pub(super) fn parts(edges: &[FaceEdge<'_>], source: End, receiver: End, asked: Asked) -> Vec<Part> {
    if let [edge] = edges {
        let chain = Chain::new(edge, source.point, receiver.point, asked);
        return vec![Part { chains: vec![chain], narrow: None }];
    }
    let parts = mean(edges, source, receiver, asked);
    let &[first, second] = edges else { return parts };
    let chains: Vec<Chain> = parts.into_iter().flat_map(|part| part.chains).collect();
    if chains.is_empty() {
        return Vec::new();
    }
    vec![Part { chains, narrow: Narrow::new([first, second], [source, receiver], asked) }]
}

/// Both forms of what comes over two edges or more.
pub(super) fn mean(edges: &[FaceEdge<'_>], source: End, receiver: End, asked: Asked) -> Vec<Part> {
    let back: Vec<FaceEdge<'_>> = edges.iter().rev().map(|edge| edge.exchanged()).collect();
    let mut parts = one_way(edges, source, receiver, asked);
    let mut others = one_way(&back, receiver, source, asked);
    for chain in others.iter_mut().flat_map(|part| &mut part.chains) {
        chain.lead.edge = edges.len() - 1 - chain.lead.edge;
    }
    parts.extend(others);
    parts
}

/// The form that is exact at the receiver's end, with its weight.
fn one_way(edges: &[FaceEdge<'_>], source: End, receiver: End, asked: Asked) -> Vec<Part> {
    let [.., before, last] = edges else { return Vec::new() };
    let weight = weight(edges, source.point, receiver.point, asked.fades);
    if weight <= 0.0 {
        return Vec::new();
    }
    let beyond = last.wedge.beyond(receiver.point, last.at_second[0]);
    let turned = before.wedge.in_plane(beyond, before.face(1));
    let front = Some(receiver.before);
    let faces = if last.at_second[0] { [None, front] } else { [front, None] };
    let lit = Lit { direct: front, faces, within: asked.within };
    let on_the_way = End { point: turned, before: false };
    let mut parts = parts(&edges[..edges.len() - 1], source, on_the_way, asked);
    for part in &mut parts {
        part.chains.retain_mut(|chain| {
            let margin =
                OFF_THE_ENDS * (before.part[1] - before.part[0]).min(chain.from.radius + turned.radius);
            let place = apex(chain.from, turned).clamp(before.part[0] + margin, before.part[1] - margin);
            let from = before.wedge.at(place);
            let on_face = last.wedge.in_plane(from, last.face(0));
            let over: Vec<EdgePath> = stretches(before, last, from)
                .into_iter()
                .map(|part| asked.path(last.wedge, on_face, receiver.point, part, lit))
                .collect();
            let detour = over.iter().map(EdgePath::detour).fold(f64::INFINITY, f64::min);
            let reach = from.distance(beyond);
            chain.length += detour - reach;
            chain.reaches = (chain.reaches.0 + reach, chain.reaches.1 * reach);
            chain.weight *= weight;
            chain.from = on_face;
            chain.others.push(over);
            detour.is_finite()
        });
    }
    parts.retain(|part| !part.chains.is_empty());
    parts
}

/// Weight of the form that is exact at the receiver's end.
fn weight(edges: &[FaceEdge<'_>], source: WedgePoint, receiver: WedgePoint, fades: bool) -> f64 {
    let (first, last) = (&edges[0], &edges[edges.len() - 1]);
    let of_receiver = square_height(receiver, last.face(0));
    // The faces of a solid are joined on one side, where the wave is heard twice.
    let sides = if first.wedge.is_rim() && last.wedge.is_rim() { 1.0 } else { 0.5 };
    let weight = sides * share(square_height(source, first.face(1)), of_receiver);
    if !fades {
        return weight;
    }
    let weight = weight * off_the_face(receiver.angle - last.face(0));
    if edges.len() < LAST {
        return weight;
    }
    let at_source = square_height(source, first.wedge.angle() - first.face(1));
    let dimmed = 1.0 - in_sight(first.wedge, source, first.face(1));
    weight
        * in_sight(last.wedge, receiver, last.face(0))
        * (1.0 - dimmed * share(of_receiver, NEAR * at_source))
}

/// a/(a + b).
fn share(a: f64, b: f64) -> f64 {
    if a + b > 0.0 { a / (a + b) } else { 0.5 }
}

/// Square height of a point over the plane of a face at the angle `face` [rad] about its edge [m²].
fn square_height(point: WedgePoint, face: f64) -> f64 {
    let height = point.radius * libm::sin(point.angle - face);
    height * height
}

/// 1, but near the face on both of its sides, where it is 0.
fn off_the_face(angle: f64) -> f64 {
    let (sine, cosine) = libm::sincos(0.5 * angle);
    sine * sine / (sine * sine + (FADED * cosine) * (FADED * cosine))
}

/// 1 before the plane of the face at the angle `face` [rad], and falling beyond it to 0 on the edge's other face, where the edge goes
/// out of sight.
fn in_sight(wedge: &Wedge, point: WedgePoint, face: f64) -> f64 {
    let left = (wedge.angle() - (point.angle - face).abs()) / (wedge.angle() - PI);
    let left = left.clamp(0.0, 1.0);
    left * left * (3.0 - 2.0 * left)
}
