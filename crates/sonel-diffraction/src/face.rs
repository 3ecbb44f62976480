//! Diffraction over two edges of a flat convex face: source, edge, along the face, edge, receiver.
//!
//! The field of one edge assumes an infinite face, so it steps where a receiver crosses the plane beside the face.
//! What it sends along the face reaches the receiver past the next edge as that of a point source on the face would. With D₁ and D₂ the
//! fields of both edges, R′ the receiver rotated about the second edge into the plane, and S′ the source about the first one,
//!
//!   C = ½ D₁(S → R′) D₂(S′ → R) |S′R′| e^(jk |S′R′|),
//!
//! ½ because a source on a face radiates with its image; the rims of a sheet are joined by both of its sides. Where it is lit from the place P of
//! the first edge that the way crosses instead of from S′, the second edge has D₂(P → R) |PR′| e^(jk |PR′|) in the place of D₂(S′ → R) |S′R′|
//! e^(jk |S′R′|): with R far from the plane, and not in it (`overlap`). In the plane D₂ jumps by twice the
//! free field where the way from P crosses the part of the second edge that P sees over the face, and not elsewhere. Every way out of a
//! face crosses one such part, so that over all of its edges H₂ jumps as D₁ does, whatever the shape, and no step is left. Beside a
//! sheet, which scatters nothing in its plane, it is −D₁ there. Where the way misses the part of the first edge, P is next to it, and S′ in line.
//!
//! A third edge is left out, and with it fades what would be cut off by it (`weight`). The formula is exact at the receiver's end only. Exchanged,
//! it is exact at the source's: [`FacePath`] takes the mean of both forms, which share C where the way is straight. A narrow face needs
//! more (`narrow`).
//!
//! Reference: [Svensson1999] for the parts (docs/references.md); measured against boundary elements in docs/diffraction.md.

use glam::DVec3;

use crate::complex::{Complex, unit};
use crate::edge_path::{EdgePath, Secondary, Visibility, WAVES};
use crate::wave_numbers::WaveNumbers;
use crate::wedge::{Wedge, WedgePoint, apex};
use overlap::Overlap;
use way::FaceWay;
use weight::weights;

mod narrow;
mod overlap;
mod way;
mod weight;

/// Least distance of P from the ends of its edge, as a share of the edge's length and of the path's [1]: the contribution of a corner comes
/// from about it. Chosen, not measured.
const OFF_THE_ENDS: f64 = 0.25;

/// Distance of places that are one, as a share of the way [1].
const SAME: f64 = 1e-9;

/// An edge of a face of a solid, or of a sheet, whose sides count as one face.
#[derive(Debug, Clone, Copy)]
pub struct FaceEdge<'a> {
    /// The edge.
    pub wedge: &'a Wedge,
    /// Whether the common face is its second one.
    pub at_second: bool,
    /// The part of it that is visible, from the source or from the receiver, from its start [m].
    pub part: [f64; 2],
}

impl FaceEdge<'_> {
    /// Angle of the common face [rad].
    pub(crate) fn face(&self) -> f64 {
        if self.at_second { self.wedge.angle() } else { 0.0 }
    }

    /// R′: where `end` is when it is turned about the edge into the plane of the face.
    fn beyond(&self, end: End) -> DVec3 {
        self.wedge.beyond(end.point, self.at_second)
    }

    /// Which waves `end` sees that come along the face from the other edge.
    fn lit(&self, end: End, within: f64) -> Visibility {
        let front = Some(end.before);
        let faces = if self.at_second { [None, front] } else { [front, None] };
        Visibility { direct: front, faces, within }
    }

    /// What its secondary sources send to `end` of what comes along the face from the other edge.
    fn secondary(&self, end: End, within: f64) -> Secondary {
        Secondary::new(self.wedge.angle(), self.face(), end.point.angle, self.lit(end, within))
    }

    /// P: where on the edge the way to the next one crosses it that comes from `from` and goes on to `turned`.
    fn lights(&self, from: WedgePoint, turned: WedgePoint) -> DVec3 {
        let [low, high] = self.part;
        let margin = OFF_THE_ENDS * (high - low).min(from.radius + turned.radius);
        self.wedge.at(apex(from, turned).clamp(low + margin, high - margin))
    }
}

/// The source about the first edge of a path, or the receiver about the last one.
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// Where it is.
    pub point: WedgePoint,
    /// Whether it is before the plane of the face, and sees the other edge past its own.
    pub before: bool,
}

/// What all paths are asked for with.
#[derive(Debug, Clone, Copy)]
struct FaceQuery {
    /// Angle from a plane [rad] within which [`End::before`] is believed.
    within: f64,
    range: [f64; 2],
}

impl FaceQuery {
    /// The path over an edge between a place on the face, or in its plane, and its end.
    fn path(self, edge: &FaceEdge<'_>, from: WedgePoint, end: End) -> EdgePath {
        EdgePath::new(edge.wedge, from, end.point, edge.part, edge.lit(end, self.within), self.range)
    }
}

/// A path over two edges of a face.
#[derive(Debug, Clone)]
pub struct FacePath {
    length: f64,
    /// The form that is exact at the receiver's end, and the one at the source's.
    forms: [Form; 2],
    /// C of either form: one where the way between the ends, unfolded, is straight.
    products: Vec<Product>,
    /// The field of the edge that does not lead a form, lit from P.
    near: [Option<EdgePath>; 2],
    overlap: Overlap,
}

/// What begins at one of the edges: the waves that it is part of are those of this edge.
#[derive(Debug, Clone, Copy)]
pub struct Lead {
    /// Which of the edges it is.
    pub edge: usize,
    /// The ends of the path over that edge about it.
    pub ends: [WedgePoint; 2],
}

/// What is exact at the end that is not its lead's.
#[derive(Debug, Clone, Copy)]
struct Form {
    lead: Lead,
    weight: f64,
    /// Where the way begins, and P, about the other edge.
    afar: WedgePoint,
    near: WedgePoint,
    /// |S′R′| and |P R′| [m].
    whole: f64,
    reach: f64,
}

/// The fields of both edges, each as if the other one were not there.
#[derive(Debug, Clone)]
struct Product {
    edges: [EdgePath; 2],
    /// |S′R′| [m].
    whole: f64,
}

impl FacePath {
    /// The path over both `edges` between `ends`, for wave numbers within `range` [1/m]. Within the angle `within` [rad] of
    /// a plane beyond an edge, on which side of it an end is, is for [`End::before`] to say.
    /// [`None`] where nothing comes over both.
    #[must_use]
    pub fn new(edges: [FaceEdge<'_>; 2], ends: [End; 2], within: f64, range: [f64; 2]) -> Option<Self> {
        let asked = FaceQuery { within, range };
        let [first, last] = edges;
        let [source, receiver] = ends;
        let weights = weights(edges, ends.map(|end| end.point));
        let there = Form::new([&first, &last], ends, weights[0]);
        let mut back = Form::new([&last, &first], [receiver, source], weights[1]);
        back.lead.edge = 1;
        let forms = [there, back];
        let is_straight = forms[0].is_along(&forms[1]) && forms[1].is_along(&forms[0]);
        let needed = forms.iter().filter(|form| form.weight > 0.0);
        let products: Vec<Product> = needed
            .map(|form| form.product(edges, ends, asked))
            .take(if is_straight { 1 } else { 2 })
            .collect();
        let length = products.iter().map(Product::length).fold(f64::INFINITY, f64::min);
        let near = forms.each_ref().map(|form| {
            let last = 1 - form.lead.edge;
            (form.weight > 0.0).then(|| asked.path(&edges[last], form.near, ends[last]))
        });
        let overlap = Overlap::new(edges, ends, asked);
        (!products.is_empty()).then_some(Self { length, forms, products, near, overlap })
    }

    /// Length of the shortest way over both edges [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    fn counted(&self) -> impl Iterator<Item = &Form> {
        self.forms.iter().filter(|form| form.weight > 0.0)
    }

    /// The edges whose waves the path is part of, in the order of [`FacePath::amplitudes`].
    pub fn leads(&self) -> impl Iterator<Item = Lead> + '_ {
        self.counted().map(|form| form.lead)
    }

    /// Amplitudes by lead, wave number and wave that the leading edge completes, to be multiplied by e^(−jk length) [1/m].
    #[must_use]
    pub fn amplitudes(&self, numbers: &WaveNumbers) -> Vec<Vec<[Complex; WAVES]>> {
        let lights = self.overlap.lights(numbers);
        let fields: Vec<[Vec<[Complex; WAVES]>; 2]> = self
            .products
            .iter()
            .map(|product| [0, 1].map(|edge| product.edges[edge].fields(numbers)))
            .collect();
        let of = |(at, form): (usize, &Form)| {
            let at = at.min(self.products.len() - 1);
            let edge = form.lead.edge;
            let near = self.near[edge].iter().flat_map(|near| near.totals(numbers));
            let factors = fields[at][1 - edge].iter().zip(near).zip(&lights[edge]).zip(numbers.values());
            let factors = factors.map(|(((far, near), light), k)| {
                let [direct, first, second] = *far;
                let far = (direct + first + second) * unit(k * form.whole) * form.whole;
                let near = near * unit(k * form.reach) * form.reach;
                let lit = far + (near - far) * light.near + far * light.more;
                lit * unit(k * self.length) * form.weight
            });
            let lead = fields[at][edge].iter().zip(factors);
            lead.map(|(terms, factor)| terms.map(|term| term * factor)).collect()
        };
        self.counted().enumerate().map(of).collect()
    }
}

impl Form {
    /// The form that is exact at the receiver's end, `weight` times.
    fn new([before, last]: [&FaceEdge<'_>; 2], [source, receiver]: [End; 2], weight: f64) -> Self {
        let turned = before.wedge.in_plane(last.beyond(receiver), before.face());
        let way = FaceWay::new([before, last], source.point, receiver);
        let (afar, longer) = way.afar([before, last], source);
        let reach = way.lights.distance(way.to);
        let lead = Lead { edge: 0, ends: [source.point, turned] };
        Self { lead, weight, afar, near: way.near, whole: longer + reach, reach }
    }

    /// Whether its way begins where that of the `other` form ends.
    fn is_along(&self, other: &Self) -> bool {
        let ends = other.lead.ends[1];
        (self.afar.radius - ends.radius).abs() + (self.afar.along - ends.along).abs() <= SAME * self.whole
    }

    fn product(&self, edges: [FaceEdge<'_>; 2], ends: [End; 2], asked: FaceQuery) -> Product {
        let beyond =
            if self.lead.edge == 0 { [self.lead.ends[1], self.afar] } else { [self.afar, self.lead.ends[1]] };
        let path = |edge: usize| asked.path(&edges[edge], beyond[edge], ends[edge]);
        Product { edges: [path(0), path(1)], whole: self.whole }
    }
}

impl Product {
    /// Length of the shortest way over both edges [m].
    fn length(&self) -> f64 {
        self.edges.iter().map(EdgePath::detour).sum::<f64>() - self.whole
    }
}

/// Where the way over both `edges` crosses them [m from their starts], from a source about the first one to a receiver about the last one.
#[must_use]
pub fn crossings([first, last]: [FaceEdge<'_>; 2], [source, receiver]: [WedgePoint; 2]) -> [f64; 2] {
    [crossing([&first, &last], source, receiver), crossing([&last, &first], receiver, source)]
}

/// Where the way from the source to the receiver, unfolded about the last edge, crosses the first one [m from its start].
fn crossing([first, last]: [&FaceEdge<'_>; 2], source: WedgePoint, receiver: WedgePoint) -> f64 {
    let beyond = last.wedge.beyond(receiver, last.at_second);
    let towards = first.wedge.in_plane(beyond, first.face());
    apex(source, towards).clamp(first.part[0], first.part[1])
}

#[cfg(test)]
mod tests;
