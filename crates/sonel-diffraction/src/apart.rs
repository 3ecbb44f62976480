//! Two parallel edges apart, of different objects: source, edge, through the air, edge, receiver.
//!
//! What an edge sends is cut off where another edge hides it, the whole edge at once if the two are parallel. Past the second edge it goes
//! on as that of a point source at the first: with D₁ the first edge's field, R′ the receiver turned about the second edge into the half
//! plane from the first, P where the way to R′ crosses the first edge, and D₂ the second edge's field of a source at P,
//!
//!   H₂ = D₁(S → R′) D₂(P → R) |P R′| e^(jk |P R′|).
//!
//! On the boundary R′ is R, and D₂ jumps by the free field from P: the sum with what comes over the first edge alone is continuous. D₁ is that of
//! the part of the first edge which R′ sees over the second, so that no more is completed than is hidden. Each of the terms of D₂
//! belongs to a wave that runs from the first edge to the receiver, straight or mirrored in a face of the second.
//!
//! The formula is exact at the receiver's end only. Exchanged, it is exact at the source's: [`ApartPath`] takes the mean of both, each
//! weighted by how much farther the other way is over its edge than past it. Away from all boundaries they are the same.
//!
//! Where the first edge lies in the plane of a face of the second one, beyond that face, what runs along the face is heard twice on it
//! and counts half, as in [`crate::face`]. On both sides of a thin sheet in that plane it is the same, and the sheet scatters nothing.
//!
//! Reference: [Svensson1999] for the parts (docs/references.md); measured against boundary elements in docs/diffraction.md.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::complex::Complex;
use crate::contour::SIX;
use crate::edge_path::{EdgePath, Lit, WAVES};
use crate::face::{End, FaceEdge, FacePath, Orders};
use crate::wave_numbers::WaveNumbers;
use crate::wedge::{Wedge, WedgePoint, apex};

/// P keeps this share of the length of its part, and of the way, from the ends of the part: what an end sends comes from about it.
const OFF_THE_ENDS: f64 = 0.25;
/// Share of the distance of the edges by which a way is longer than on a boundary where it no longer counts as near that.
const NEAR: f64 = 2e-5;
/// Parts of an edge that are shorter than this send nothing, and edges that are nearer to the plane of a face lie in it [m].
const SHORTEST: f64 = 1e-6;

/// One side of the air between two edges: the edge there, and the source or receiver beyond it.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// The edge at the air; its part is what its end sees of it. It is reached over the first of its faces that are named.
    pub edge: FaceEdge<'a>,
    /// An edge between the end and that one, joined to it by a face; left over the second of its faces that are named.
    pub beyond: Option<FaceEdge<'a>>,
    /// The source or the receiver about the outer one of the edges.
    pub end: End,
    /// What else it sees.
    pub view: View<'a>,
    /// 1, and less towards 0 where its end is about to lose sight of the outer edge, and a longer path that would complete this one is left
    /// out.
    pub share: f64,
}

/// What an end sees past its edge. It is asked only where the end is so near to a boundary that rounding decides.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// Angle from a boundary [rad] within which it is asked.
    pub within: f64,
    /// The stretches of the other edge that are seen, from its start [m].
    pub past: &'a dyn Fn() -> Vec<[f64; 2]>,
    /// Whether the mirror image of a point [m] in the first or second face is seen; [`None`] where nobody knows.
    pub in_face: &'a dyn Fn(usize, DVec3) -> Option<bool>,
}

/// A path over two edges apart.
#[derive(Debug, Clone)]
pub struct ApartPath {
    length: f64,
    crossings: [f64; 2],
    chains: Vec<Chain>,
}

/// A product of the fields of two sides.
#[derive(Debug, Clone)]
struct Chain {
    /// Which side leads.
    side: usize,
    /// Where the way crosses both edges, the leading one first [m from their starts].
    crossings: [f64; 2],
    lead: Over,
    trail: Over,
    /// About the trailing edge: what lights it, and its end.
    of_trail: [WedgePoint; 2],
    /// |P R′| [m].
    reach: f64,
    weight: f64,
    /// Whether the leading edge lies in the plane of a face of the trailing one, whose terms are then one.
    on_face: bool,
}

/// A field over the edges of one side.
#[derive(Debug, Clone)]
enum Over {
    /// Over the edge at the air, and its ends about that.
    One(EdgePath, [WedgePoint; 2]),
    Two(FacePath),
}

/// A part of an edge that sends past another one.
struct Part {
    /// From where to where it is [m].
    part: [f64; 2],
    /// The part, not too near to whose ends the place P is that stands for it.
    about: [f64; 2],
    /// Whether it is seen past the other edge, where its position does not tell.
    seen: Option<bool>,
}

/// What a piece of a field over the edges of one side sends.
struct Sent {
    /// Whether its waves are completed by the edge beyond.
    beyond: bool,
    /// The ends of the path about the edge that completes them.
    ends: [WedgePoint; 2],
    /// Length with which it rotates [m].
    length: f64,
    /// Slowly varying amplitudes by wave at every wave number [1/m].
    fields: Vec<[Complex; WAVES]>,
}

/// A wave's edge: which of the sides it is on, whether it is the one beyond that at the air, and the ends of the path over it about it.
#[derive(Debug, Clone, Copy)]
pub struct Led {
    /// Index of the side.
    pub side: usize,
    /// Whether the edge is the one beyond.
    pub beyond: bool,
    /// The ends of the path over the edge.
    pub ends: [WedgePoint; 2],
}

/// Products of the waves that a leading edge completes with those that the edge at the air on the other side does.
#[derive(Debug, Clone)]
pub struct Products {
    /// The leading edge.
    pub lead: Led,
    /// The other one; [`None`] where nothing but a direct wave is completed there.
    pub other: Option<Led>,
    /// Length with which they rotate [m].
    pub length: f64,
    /// Slowly varying amplitudes by wave number, wave of the leading edge and wave of the other one, to be multiplied by
    /// e^(−jk length) [1/m].
    pub amplitudes: Vec<[[Complex; WAVES]; WAVES]>,
}

impl ApartPath {
    /// The path from the end of the first to the end of the second side, for wave numbers of at least `smallest_k` [1/m].
    /// [`None`] where nothing comes over both.
    #[must_use]
    pub fn new(sides: [Side<'_>; 2], smallest_k: f64) -> Option<Self> {
        let [first, last] = sides;
        let mut chains = one_way(&first, &last, smallest_k);
        for mut chain in one_way(&last, &first, smallest_k) {
            chain.side = 1;
            chain.crossings.reverse();
            chains.push(chain);
        }
        let shortest = chains.iter().min_by(|one, other| one.length().total_cmp(&other.length()))?;
        Some(Self { length: shortest.length(), crossings: shortest.crossings, chains })
    }

    /// Length of the shortest way over both edges [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Where the way crosses the outer edges of the first and of the second side [m from their starts].
    #[must_use]
    pub fn crossings(&self) -> [f64; 2] {
        self.crossings
    }

    /// The field, as products of waves.
    #[must_use]
    pub fn products(&self, numbers: &WaveNumbers) -> Vec<Products> {
        self.chains.iter().flat_map(|chain| chain.products(numbers)).collect()
    }
}

impl Chain {
    fn length(&self) -> f64 {
        self.lead.length() + self.trail.length() - self.reach
    }

    fn products(&self, numbers: &WaveNumbers) -> Vec<Products> {
        let is_one = matches!(self.trail, Over::One(..)) && !self.on_face;
        let mut trail = vec![[Complex::ZERO; WAVES]; numbers.values().len()];
        for Sent { length, fields, .. } in self.trail.sent(numbers) {
            for ((sum, terms), k) in trail.iter_mut().zip(fields).zip(numbers.values()) {
                let factor = Complex::unit(k * (self.trail.length() - length)) * (self.reach * self.weight);
                if is_one {
                    sum.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term * factor);
                } else {
                    let half = if self.on_face { 0.5 } else { 1.0 };
                    sum[0] += (terms[0] + terms[1] + terms[2]) * factor * half;
                }
            }
        }
        let other = Led { side: 1 - self.side, beyond: false, ends: self.of_trail };
        let products = |Sent { beyond, ends, length, fields }: Sent| Products {
            lead: Led { side: self.side, beyond, ends },
            other: is_one.then_some(other),
            length: length + self.trail.length() - self.reach,
            amplitudes: fields
                .iter()
                .zip(&trail)
                .map(|(lead, trail)| lead.map(|lead| trail.map(|trail| lead * trail)))
                .collect(),
        };
        self.lead.sent(numbers).into_iter().map(products).collect()
    }
}

impl Over {
    fn length(&self) -> f64 {
        match self {
            Self::One(path, _) => path.detour(),
            Self::Two(path) => path.length(),
        }
    }

    /// What every piece of it sends that completes waves.
    fn sent(&self, numbers: &WaveNumbers) -> Vec<Sent> {
        match self {
            Self::One(path, ends) => path
                .lengths()
                .enumerate()
                .map(|(piece, length)| Sent {
                    beyond: false,
                    ends: *ends,
                    length,
                    fields: path.amplitudes(piece, numbers),
                })
                .collect(),
            Self::Two(path) => path
                .leads()
                .zip(path.amplitudes(numbers))
                .map(|(lead, fields)| Sent {
                    beyond: lead.edge == 0,
                    ends: lead.ends,
                    length: path.length(),
                    fields,
                })
                .collect(),
        }
    }
}

/// The form that is exact at the end of `last`, with its weight.
fn one_way(first: &Side<'_>, last: &Side<'_>, smallest_k: f64) -> Vec<Chain> {
    let (Some(before), Some(behind)) = (last.locate_middle_of(first), first.locate_middle_of(last)) else {
        return Vec::new();
    };
    let [near, far] = [first, last].map(Side::point_at_air);
    let around = [obstructed(first.edge.wedge, behind, near), obstructed(last.edge.wedge, before, far)];
    // Where an end is about to lose sight of its edge the form fades, but not on its own boundaries, where it completes what is hidden.
    let off_boundaries = share(around[1], NEAR * before.radius);
    let [first_left, last_left] = [first, last].map(|side| 1.0 - (1.0 - side.share) * off_boundaries);
    let weight = share(around[0], around[1]) * first_left * last_left;
    let wedge = last.edge.wedge;
    let across = (first.middle() - wedge.at(before.along)) / before.radius;
    let beyond = wedge.at(far.along) - across * far.radius;
    let Some(turned) = first.edge.wedge.locate(beyond) else { return Vec::new() };
    if weight <= 0.0 {
        return Vec::new();
    }
    let mut chains = Vec::new();
    for Part { part, about, seen } in parts(first, last, window(first, last, before.radius, beyond)) {
        let margin = OFF_THE_ENDS * (about[1] - about[0]).min(near.radius + turned.radius);
        let crossing = apex(near, turned).clamp(about[0] + margin, about[1] - margin);
        let place = first.edge.wedge.at(crossing);
        let Some((from, on_face)) = last.seen_from(place) else { continue };
        if on_face && (wedge.is_rim() || last.beyond.is_some()) {
            continue;
        }
        let lit = Lit { direct: seen, faces: last.faces(from, place), within: last.view.within };
        let lead = first.over(turned, part, Lit::default(), smallest_k);
        let trail = last.over(from, last.edge.part, lit, smallest_k);
        if let (Some(lead), Some(trail)) = (lead, trail) {
            chains.push(Chain {
                side: 0,
                crossings: [first.crossing(&lead), last.crossing(&trail)],
                lead,
                trail,
                of_trail: [from, far],
                reach: place.distance(beyond),
                weight,
                on_face,
            });
        }
    }
    chains
}

impl Side<'_> {
    fn middle(&self) -> DVec3 {
        self.edge.wedge.at(0.5 * (self.edge.part[0] + self.edge.part[1]))
    }

    fn locate_middle_of(&self, other: &Self) -> Option<WedgePoint> {
        self.edge.wedge.locate(other.middle())
    }

    /// The end about the edge at the air: turned into the plane of the face between the edges, where there is another one beyond.
    fn point_at_air(&self) -> WedgePoint {
        self.beyond.map_or(self.end.point, |beyond| {
            let place = beyond.wedge.beyond(self.end.point, beyond.at_second[1]);
            self.edge.wedge.in_plane(place, self.edge.face(0))
        })
    }

    /// The field between the end and a point about the edge at the air over that `part` of the edge.
    fn over(&self, point: WedgePoint, part: [f64; 2], lit: Lit, smallest_k: f64) -> Option<Over> {
        let wedge = self.edge.wedge;
        let Some(beyond) = self.beyond else {
            let path = EdgePath::by(SIX, wedge, self.end.point, point, part, lit, smallest_k);
            return Some(Over::One(path, [self.end.point, point]));
        };
        let edges = [beyond, FaceEdge { part, ..self.edge }];
        let before = (point.angle - self.edge.face(0)).abs() < PI;
        let ends = [self.end, End { point, before }];
        // Ways over three edges of one face are not followed beyond the air.
        let orders = Orders { along_a_face: false, ..Orders::ALL };
        FacePath::new(&edges, ends, self.view.within, smallest_k, orders).map(Over::Two)
    }

    /// Where a way over the outer edge crosses that [m from its start].
    fn crossing(&self, over: &Over) -> f64 {
        match over {
            Over::One(_, ends) => apex(ends[0], ends[1]).clamp(self.edge.part[0], self.edge.part[1]),
            Over::Two(path) => path.crossings()[0],
        }
    }

    /// Where a place on the other edge is about this one, and whether it lies in the plane of a face.
    fn seen_from(&self, place: DVec3) -> Option<(WedgePoint, bool)> {
        let from = self.edge.wedge.locate(place)?;
        let faces = [0.0, self.edge.wedge.angle()];
        let face = faces.into_iter().find(|face| (from.angle - face).abs() * from.radius <= SHORTEST);
        Some((WedgePoint { angle: face.unwrap_or(from.angle), ..from }, face.is_some()))
    }

    /// Whether the images of `place`, which is at `from` about the edge, in the faces are seen, where that is for rounding to say.
    fn faces(&self, from: WedgePoint, place: DVec3) -> [Option<bool>; 2] {
        let turns = turns(self.edge.wedge, from, self.point_at_air());
        [0, 1].map(|face| {
            let is_close = self.beyond.is_none() && (turns[1 + face] - PI).abs() <= self.view.within;
            is_close.then(|| (self.view.in_face)(face, place)).flatten()
        })
    }
}

/// By how much the waves turn about an edge between two points [rad]: the direct one, and those mirrored in its faces. Each is cut off at π.
fn turns(wedge: &Wedge, from: WedgePoint, to: WedgePoint) -> [f64; WAVES] {
    let sum = from.angle + to.angle;
    [(from.angle - to.angle).abs(), sum, 2.0 * wedge.angle() - sum]
}

/// How much longer the way from the other edge, which is at `other`, to the end is over an edge than that of the wave whose boundary is
/// nearest: 0 on any of the boundaries [m].
fn obstructed(wedge: &Wedge, other: WedgePoint, end: WedgePoint) -> f64 {
    let (product, sum) = (other.radius * end.radius, other.radius + end.radius);
    let longer = |turn: f64| {
        let half = libm::cos(0.5 * turn.min(TAU));
        let excess = 4.0 * product * half * half;
        excess / (sum + (sum * sum - excess).max(0.0).sqrt())
    };
    1.0 / turns(wedge, other, end).iter().map(|turn| 1.0 / longer(*turn)).sum::<f64>()
}

/// a/(a + b).
fn share(a: f64, b: f64) -> f64 {
    if a + b > 0.0 { a / (a + b) } else { 0.5 }
}

/// The part of the edge `first` that is seen from the point `beyond` over what is seen of `last`, `apart` [m] from it.
fn window(first: &Side<'_>, last: &Side<'_>, apart: f64, beyond: DVec3) -> [f64; 2] {
    let radius = last.point_at_air().radius;
    let stretch = (apart + radius) / radius.max(SHORTEST);
    let (wedge, part) = (first.edge.wedge, first.edge.part);
    let ends = last.edge.part.map(|end| {
        let place = beyond + (last.edge.wedge.at(end) - beyond) * stretch;
        (place - wedge.at(0.0)).dot(wedge.direction())
    });
    let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
    [low.max(part[0]), high.min(part[1])]
}

/// What of `window` of the edge `first` is seen by the end of `last` and what is hidden; as one part, where all of it is on the same side of the
/// boundary.
fn parts(first: &Side<'_>, last: &Side<'_>, window: [f64; 2]) -> impl Iterator<Item = Part> {
    let beyond = |along: f64| {
        let from = last.edge.wedge.locate(first.edge.wedge.at(along))?;
        Some(turns(last.edge.wedge, from, last.end.point)[0] - PI)
    };
    let [low, high] = window.map(|along| beyond(along).unwrap_or(0.0));
    let is_in_doubt = [low, high].map(|beyond| last.beyond.is_none() && beyond.abs() <= last.view.within);
    let is_crossed = last.beyond.is_none() && low * high < 0.0;
    let mut parts = Vec::new();
    if is_crossed || is_in_doubt.contains(&true) {
        let mut add = |part: [f64; 2], seen| {
            // All that is in doubt is seen from one place, as it is where none of it is.
            let about = if is_in_doubt == [true; 2] { window } else { part };
            parts.push(Part { part, about, seen: Some(seen) });
        };
        let mut hidden = window[0];
        for [from, to] in (last.view.past)() {
            let [from, to] = [from, to].map(|place| place.clamp(window[0], window[1].max(window[0])));
            add([hidden, from], false);
            add([from, to], true);
            hidden = to;
        }
        add([hidden, window[1]], false);
    } else {
        parts.push(Part { part: window, about: window, seen: None });
    }
    parts.into_iter().filter(|Part { part: [from, to], .. }| to - from > SHORTEST)
}

#[cfg(test)]
mod tests;
