//! Diffraction over two edges of a flat convex face: source, edge, along the face, edge, receiver.
//!
//! The field of one edge assumes an infinite face, so it steps where a receiver crosses the plane beside the face.
//! What it sends along the face reaches the receiver past the next edge as that of a point source on the face would: with D₁ the first
//! edge's field, R′ the receiver rotated about the second edge into the plane, P where the path to it crosses the first
//! edge, and D₂
//! the second edge's field of a source at P on the face,
//!
//!   H₂ = ½ D₁(S → R′) D₂(P → R) |P R′| e^(jk |P R′|),
//!
//! ½ because a source on a face radiates with its image; the rims of a sheet are joined by both of its sides. In the plane
//! D₂ jumps by twice the
//! free field where the way from P crosses the part of the second edge that P sees over the face, and not elsewhere. Every way out of a
//! face crosses one such part, so that over all of its edges H₂ jumps as D₁ does, whatever the shape, and no step is left. Beside a
//! sheet, which scatters nothing in its plane, it is −D₁ there.
//!
//! A third edge is left out, and with it fades what would be cut off by it (`weight`). The formula is exact at the receiver's end only. Exchanged,
//! it is exact at the source's: [`FacePath`] takes the mean of both forms. Where both ends are near the plane the edges are not lit from one
//! another alone (`overlap`), nor where the face is narrow (`narrow`).
//!
//! Reference: [Svensson1999] for the parts (docs/references.md); measured against boundary elements in docs/diffraction.md.

use glam::DVec3;

use crate::complex::Complex;
use crate::contour::SIX;
use crate::edge_path::{EdgePath, Secondary, Visibility, WAVES};
use crate::wave_numbers::WaveNumbers;
use crate::wedge::{Wedge, WedgePoint, apex};
use overlap::{Light, Overlap};
use way::FaceWay;
use weight::weights;

mod narrow;
mod overlap;
mod way;
mod weight;

/// Least distance of P from the ends of its edge, as a share of the edge's length and of the path's [1]: the contribution of a corner comes
/// from about it. Chosen, not measured.
const OFF_THE_ENDS: f64 = 0.25;

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
    smallest_k: f64,
}

impl FaceQuery {
    fn path(self, edge: &FaceEdge<'_>, from: WedgePoint, to: WedgePoint, lit: Visibility) -> EdgePath {
        EdgePath::by(SIX, edge.wedge, from, to, edge.part, lit, self.smallest_k)
    }
}

/// A path over two edges of a face.
#[derive(Debug, Clone)]
pub struct FacePath {
    length: f64,
    /// The form that is exact at the receiver's end, and the one at the source's.
    forms: [Option<Form>; 2],
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

/// A product of the fields of both edges: the second one is lit by a point source on the first.
#[derive(Debug, Clone)]
struct Form {
    lead: Lead,
    weight: f64,
    /// Length of the shortest way [m].
    length: f64,
    first: EdgePath,
    /// The second edge, lit from the first one, and from as far as the sound comes from.
    near: Beam,
    far: Beam,
}

/// The field of a point source past an edge.
#[derive(Debug, Clone)]
struct Beam {
    path: EdgePath,
    /// The way to R′ [m].
    reach: f64,
}

impl FacePath {
    /// The path over both `edges` between `ends`, for wave numbers of at least `smallest_k` [1/m]. Within the angle `within` [rad] of
    /// a plane beyond an edge, on which side of it an end is, is for [`End::before`] to say.
    /// [`None`] where nothing comes over both.
    #[must_use]
    pub fn new(edges: [FaceEdge<'_>; 2], ends: [End; 2], within: f64, smallest_k: f64) -> Option<Self> {
        let asked = FaceQuery { within, smallest_k };
        let [first, last] = edges;
        let [source, receiver] = ends;
        let weights = weights(edges, ends.map(|end| end.point));
        let there = Form::new([&first, &last], ends, weights[0], asked);
        let mut back = Form::new([&last, &first], [receiver, source], weights[1], asked);
        back.iter_mut().for_each(|form| form.lead.edge = 1);
        let forms = [there, back];
        let length = forms.iter().flatten().map(|form| form.length).fold(f64::INFINITY, f64::min);
        length.is_finite().then(|| Self { length, forms, overlap: Overlap::new(edges, ends, asked) })
    }

    /// Length of the shortest way over both edges [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The edges whose waves the path is part of, in the order of [`FacePath::amplitudes`].
    pub fn leads(&self) -> impl Iterator<Item = Lead> + '_ {
        self.forms.iter().flatten().map(|form| form.lead)
    }

    /// Amplitudes by lead, wave number and wave that the leading edge completes, to be multiplied by e^(−jk length) [1/m].
    #[must_use]
    pub fn amplitudes(&self, numbers: &WaveNumbers) -> Vec<Vec<[Complex; WAVES]>> {
        let lights = self.overlap.lights(numbers);
        let forms = self.forms.iter().zip(&lights);
        forms
            .filter_map(|(form, lights)| Some(form.as_ref()?.amplitudes(numbers, self.length, lights)))
            .collect()
    }
}

impl Form {
    /// The form that is exact at the receiver's end, `weight` times.
    fn new(
        [before, last]: [&FaceEdge<'_>; 2],
        [source, receiver]: [End; 2],
        weight: f64,
        asked: FaceQuery,
    ) -> Option<Self> {
        if weight <= 0.0 {
            return None;
        }
        let turned = before.wedge.in_plane(last.beyond(receiver), before.face());
        let first = asked.path(before, source.point, turned, Visibility::default());
        let way = FaceWay::new([before, last], source.point, receiver);
        let lit = last.lit(receiver, asked.within);
        let beam =
            |from: WedgePoint, reach: f64| Beam { path: asked.path(last, from, receiver.point, lit), reach };
        let near = beam(way.near, way.lights.distance(way.to));
        let (afar, longer) = way.afar([before, last], source);
        let far = beam(afar, near.reach + longer);
        let length = first.detour() + near.path.detour() - near.reach;
        let lead = Lead { edge: 0, ends: [source.point, turned] };
        Some(Self { lead, weight, length, first, near, far })
    }

    /// Amplitudes at every wave number by the wave that the leading edge completes, to be multiplied by e^(−jk length) [1/m].
    fn amplitudes(&self, numbers: &WaveNumbers, length: f64, lights: &[Light]) -> Vec<[Complex; WAVES]> {
        let left = self.near.left(numbers).into_iter().zip(self.far.left(numbers)).zip(lights);
        let factors = left.zip(numbers.values()).map(|(((near, far), light), k)| {
            let lit = far + (near - far) * light.near + far * light.more;
            lit * (Complex::unit(k * length) * self.weight)
        });
        let first = self.first.fields(numbers).into_iter();
        first.zip(factors).map(|(terms, factor)| terms.map(|term| term * factor)).collect()
    }
}

impl Beam {
    /// The share of the sound at R′ that there is at the receiver, at every wave number.
    fn left(&self, numbers: &WaveNumbers) -> Vec<Complex> {
        let free = |k: &f64| Complex::unit(k * self.reach) * self.reach;
        self.path.totals(numbers).into_iter().zip(numbers.values()).map(|(left, k)| left * free(k)).collect()
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
