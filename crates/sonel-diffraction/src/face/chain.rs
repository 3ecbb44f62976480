//! Products of fields of first order, one an edge: each edge is lit by a point source on the edge before.
//!
//! A path over n edges is the mean of two forms. That of the receiver takes what arrives at R′ over the first n − 1 edges, exactly as it
//! would be heard there, past the last; that of the source is the same with both exchanged. Where the receiver crosses the plane before the
//! last edge the receiver's form has to be heard alone and whole, where the source crosses that behind the first the source's. Where
//! either edge comes into sight the path of most edges has to begin with nothing, since no longer one completes it.

use super::cut::seen_over;
use super::outline::stretches;
use super::overlap::{Light, Overlap};
use super::way::FaceWay;
use super::weight::weights;
use super::{End, FaceEdge, Lead, Orders};
use crate::complex::Complex;
use crate::contour::SIX;
use crate::edge_path::{EdgePath, Lit, WAVES};
use crate::wave_numbers::WaveNumbers;
use crate::wedge::{Wedge, WedgePoint};

/// What all paths are asked for with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    /// Angle from a plane [rad] within which [`End::before`] is believed.
    pub within: f64,
    pub smallest_k: f64,
    pub orders: Orders,
}

impl Asked {
    fn path(self, wedge: &Wedge, from: WedgePoint, to: WedgePoint, part: [f64; 2], lit: Lit) -> EdgePath {
        EdgePath::by(SIX, wedge, from, to, part, lit, self.smallest_k)
    }
}

/// Forms of what comes over the same edges, and how those are lit.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub chains: Vec<Chain>,
    overlap: Option<Overlap>,
}

/// A product of fields.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    pub lead: Lead,
    /// Which form of what comes over its first two edges it is of: the receiver's, or the source's.
    form: usize,
    first: EdgePath,
    others: Vec<Over>,
    /// Length of the shortest way [m].
    pub length: f64,
    weight: f64,
    /// What lights the edge it ends at, about that.
    from: WedgePoint,
}

/// What an edge leaves of the sound that comes along the face before it.
#[derive(Debug, Clone)]
struct Over {
    /// Lit from the edge before.
    near: Beam,
    /// Lit from as far as the sound comes from; none where only what the edge before sends matters.
    far: Option<Beam>,
}

/// The field of a point source past an edge, over the parts of that which are seen.
#[derive(Debug, Clone)]
struct Beam {
    paths: Vec<EdgePath>,
    /// The way to R′ [m].
    reach: f64,
}

impl Part {
    /// Amplitudes by chain and wave number, to be multiplied by e^(−jk length) [1/m].
    pub fn amplitudes(&self, numbers: &WaveNumbers, length: f64) -> Vec<Vec<[Complex; WAVES]>> {
        let lights = self.overlap.as_ref().map(|overlap| overlap.lights(numbers));
        let of_chain = |chain: &Chain| {
            chain.amplitudes(numbers, length, lights.as_ref().map(|of_forms| &of_forms[chain.form][..]))
        };
        self.chains.iter().map(of_chain).collect()
    }
}

impl Chain {
    /// Over the only edge.
    fn new(edge: &FaceEdge<'_>, source: WedgePoint, receiver: WedgePoint, asked: Asked) -> Self {
        let first = asked.path(edge.wedge, source, receiver, edge.part, Lit::default());
        Self {
            lead: Lead { edge: 0, ends: [source, receiver] },
            form: 0,
            others: Vec::new(),
            length: first.detour(),
            first,
            weight: 1.0,
            from: source,
        }
    }

    /// Amplitudes at every wave number by the wave that the leading edge completes, to be multiplied by e^(−jk length) [1/m].
    fn amplitudes(
        &self,
        numbers: &WaveNumbers,
        length: f64,
        lights: Option<&[Light]>,
    ) -> Vec<[Complex; WAVES]> {
        let turn = |k: &f64| Complex::unit(k * length) * self.weight;
        let mut factors: Vec<Complex> = numbers.values().iter().map(turn).collect();
        for over in &self.others {
            let left = over.left(numbers, lights);
            factors.iter_mut().zip(left).for_each(|(factor, left)| *factor = *factor * left);
        }
        let first = self.first.fields(numbers).into_iter();
        first.zip(factors).map(|(terms, factor)| terms.map(|term| term * factor)).collect()
    }
}

impl Over {
    /// The share of the sound at R′ that there is at the receiver, at every wave number. `lights` is how the edge is lit.
    fn left(&self, numbers: &WaveNumbers, lights: Option<&[Light]>) -> Vec<Complex> {
        let near = self.near.left(numbers);
        let (Some(far), Some(lights)) = (&self.far, lights) else { return near };
        let far = far.left(numbers);
        let lit = |((&near, &far), light): ((&Complex, &Complex), &Light)| {
            far + (near - far) * light.near + far * light.more
        };
        near.iter().zip(&far).zip(lights).map(lit).collect()
    }
}

impl Beam {
    fn left(&self, numbers: &WaveNumbers) -> Vec<Complex> {
        let free = |k: &f64| Complex::unit(k * self.reach) * self.reach;
        let mut left = vec![Complex::ZERO; numbers.values().len()];
        for path in &self.paths {
            left.iter_mut().zip(path.totals(numbers)).for_each(|(left, field)| *left += field);
        }
        left.iter().zip(numbers.values()).map(|(&left, k)| left * free(k)).collect()
    }
}

/// All that comes over `edges`.
pub(super) fn parts(edges: &[FaceEdge<'_>], source: End, receiver: End, asked: Asked) -> Vec<Part> {
    match edges {
        [edge] => {
            let chain = Chain::new(edge, source.point, receiver.point, asked);
            vec![Part { chains: vec![chain], overlap: None }]
        }
        &[first, second] => pair([first, second], [source, receiver], asked).into_iter().collect(),
        _ => mean(edges, source, receiver, asked),
    }
}

/// What comes over two edges; [`None`] where nothing does.
fn pair(edges: [FaceEdge<'_>; 2], ends: [End; 2], asked: Asked) -> Option<Part> {
    let parts = mean(&edges, ends[0], ends[1], asked);
    let chains: Vec<Chain> = parts.into_iter().flat_map(|part| part.chains).collect();
    if chains.is_empty() {
        return None;
    }
    Some(Part { chains, overlap: Some(Overlap::new(edges, ends, asked)) })
}

/// Both forms of what comes over two edges or more.
fn mean(edges: &[FaceEdge<'_>], source: End, receiver: End, asked: Asked) -> Vec<Part> {
    let weights = weights(edges, [source.point, receiver.point], asked.orders);
    let back: Vec<FaceEdge<'_>> = edges.iter().rev().map(|edge| edge.exchanged()).collect();
    let mut parts = one_way(edges, source, receiver, weights[0], asked);
    let mut others = one_way(&back, receiver, source, weights[1], asked);
    for chain in others.iter_mut().flat_map(|part| &mut part.chains) {
        chain.lead.edge = edges.len() - 1 - chain.lead.edge;
        if edges.len() == 2 {
            chain.form = 1;
        }
    }
    parts.extend(others);
    parts
}

/// The form that is exact at the receiver's end, `weight` times.
fn one_way(edges: &[FaceEdge<'_>], source: End, receiver: End, weight: f64, asked: Asked) -> Vec<Part> {
    let [.., before, last] = edges else { return Vec::new() };
    if weight <= 0.0 {
        return Vec::new();
    }
    let turned = before.wedge.in_plane(last.beyond(receiver), before.face(1));
    let on_the_way = End { point: turned, before: false };
    let begins = (edges.len() == 2).then_some(source);
    let mut found = Vec::new();
    for (part, share) in seen_over([before, last], receiver.point) {
        let before = FaceEdge { part, ..*before };
        let edges = [&edges[..edges.len() - 2], &[before]].concat();
        let mut parts = parts(&edges, source, on_the_way, asked);
        for part in &mut parts {
            part.chains.retain_mut(|chain| {
                chain.weight *= weight * share;
                chain.go_on([&before, last], begins, receiver, asked)
            });
        }
        found.extend(parts.into_iter().filter(|part| !part.chains.is_empty()));
    }
    found
}

impl Chain {
    /// Goes on from the edge `before`, where it ends, over the `last` one; whether it can. `begins` is where it comes from if that may
    /// matter to the last edge.
    fn go_on(
        &mut self,
        [before, last]: [&FaceEdge<'_>; 2],
        begins: Option<End>,
        receiver: End,
        asked: Asked,
    ) -> bool {
        let way = FaceWay::new([before, last], self.from, receiver);
        let lit = last.lit(receiver, asked.within);
        let parts = stretches(before, last, way.lights);
        let beam = |from: WedgePoint, reach: f64| Beam {
            paths: parts
                .iter()
                .map(|&part| asked.path(last.wedge, from, receiver.point, part, lit))
                .collect(),
            reach,
        };
        let near = beam(way.near, way.lights.distance(way.to));
        let detour = near.paths.iter().map(EdgePath::detour).fold(f64::INFINITY, f64::min);
        self.length += detour - near.reach;
        let far = begins.map(|source| {
            let (far, longer) = way.afar([before, last], source);
            beam(far, near.reach + longer)
        });
        self.from = way.near;
        self.others.push(Over { near, far });
        detour.is_finite()
    }
}
