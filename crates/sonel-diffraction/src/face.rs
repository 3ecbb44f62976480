//! Two and three edges, each joined to the next by a flat face, whichever way they run: source, edge, along the face, edge, …, receiver.
//!
//! Each edge alone takes the face to go on for ever, so that its field steps where a receiver crosses the plane of the face beside it.
//! What it sends along the face reaches the receiver past the next edge as that of a point source on the face would: with D₁ the first
//! edge's field, R′ the receiver turned about the second edge into the plane, P where the way to it crosses the first edge, and D₂
//! the second edge's field of a source at P on the face,
//!
//!   H₂ = ½ D₁(S → R′) D₂(P → R) |P R′| e^(jk |P R′|),
//!
//! ½ because a source on a face is heard twice; the rims of a sheet are joined by both of its sides. In the plane D₂ jumps by twice the
//! free field where the way from P crosses the part of the second edge that P sees over the face, and not elsewhere. Every way out of a
//! face crosses one such part, so that over all of its edges H₂ jumps as D₁ does, whatever the shape, and no step is left. Beside a
//! sheet, which scatters nothing in its plane, it is −D₁ there.
//!
//! H₂ itself begins where its second edge comes into sight over the plane of that edge's other face. With H₂ in the place of D₁ the same
//! formula gives H₃ over the edges of that face, and nothing steps there either; so does H₃ over a third edge of the same face, where that cuts
//! off what grazes it. What would run on to a fourth edge, or to a third one of a sheet, is left out, and with it fades what would be cut
//! off by it (`weight`).
//!
//! The formula is exact at the receiver's end only. Exchanged, it is exact at the source's: [`FacePath`] takes the mean of both. Where
//! both ends are near the plane the edges are not lit from one another alone (`overlap`), nor where the face is narrow (`narrow`).
//!
//! Reference: [Svensson1999] for the parts (docs/references.md); measured against boundary elements in docs/diffraction.md.

use glam::DVec3;

use crate::complex::Complex;
use crate::edge_path::{Lit, Secondary, WAVES};
use crate::wave_numbers::WaveNumbers;
use crate::wedge::{Wedge, WedgePoint, apex};
use chain::{Asked, Part, parts};

mod chain;
mod cut;
mod narrow;
mod outline;
mod overlap;
mod way;
mod weight;

/// P keeps this share of the length of its edge, and of the way, from the ends of the edge: what a corner sends comes from about it.
const OFF_THE_ENDS: f64 = 0.25;

/// An edge between two faces that sound runs along: of a solid, or of a sheet, whose sides count as one face.
#[derive(Debug, Clone, Copy)]
pub struct FaceEdge<'a> {
    /// The edge.
    pub wedge: &'a Wedge,
    /// Whether the face from the edge before is its second one, and whether that to the next edge is.
    pub at_second: [bool; 2],
    /// The part of it that is seen: of the first edge by the source, of the last by the receiver, from its start [m].
    pub part: [f64; 2],
    /// The rims of its sheet [m], where that is not convex; empty otherwise.
    pub outline: &'a [[DVec3; 2]],
}

impl FaceEdge<'_> {
    /// The way back.
    fn exchanged(mut self) -> Self {
        self.at_second.reverse();
        self
    }

    /// Angle of the face towards the edge before (0) or the next one (1) [rad].
    pub(crate) fn face(&self, side: usize) -> f64 {
        if self.at_second[side] { self.wedge.angle() } else { 0.0 }
    }

    /// R′: where `end` is when it is turned about the edge into the plane of the face towards the edge before.
    fn beyond(&self, end: End) -> DVec3 {
        self.wedge.beyond(end.point, self.at_second[0])
    }

    /// Which waves `end` sees that come along the face from the edge before.
    fn lit(&self, end: End, within: f64) -> Lit {
        let front = Some(end.before);
        let faces = if self.at_second[0] { [None, front] } else { [front, None] };
        Lit { direct: front, faces, within }
    }

    /// What its secondary sources send to `end` of what comes along the face from the edge before.
    fn secondary(&self, end: End, within: f64) -> Secondary {
        Secondary::new(self.wedge.angle(), self.face(0), end.point.angle, self.lit(end, within))
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
    /// Whether it is before the plane of the face that joins its edge to the others, and sees these past it.
    pub before: bool,
}

/// Which paths there are about a solid: each completes shorter ones where those are cut off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Orders {
    /// Over how many edges the longest go: one, two or three.
    pub most: usize,
    /// Whether some go over three edges of one face.
    pub along_a_face: bool,
}

impl Orders {
    /// All that there may be.
    pub const ALL: Self = Self { most: 3, along_a_face: true };
}

/// A path over several edges.
#[derive(Debug, Clone)]
pub struct FacePath {
    length: f64,
    crossings: [f64; 2],
    parts: Vec<Part>,
}

/// What begins at one of the edges: the waves that it is part of are those of this edge.
#[derive(Debug, Clone, Copy)]
pub struct Lead {
    /// Which of the edges it is.
    pub edge: usize,
    /// The ends of the path over that edge about it.
    pub ends: [WedgePoint; 2],
}

impl FacePath {
    /// The path over `edges`, two or three of them, for wave numbers of at least `smallest_k` [1/m]. Within the angle `within` [rad] of
    /// a plane beyond an edge, on which side of it an end is, is for [`End::before`] to say.
    /// `orders` are those that are heard as well.
    /// [`None`] where nothing comes over all of them.
    #[must_use]
    pub fn new(
        edges: &[FaceEdge<'_>],
        [source, receiver]: [End; 2],
        within: f64,
        smallest_k: f64,
        orders: Orders,
    ) -> Option<Self> {
        let parts = parts(edges, source, receiver, Asked { within, smallest_k, orders });
        let lengths = parts.iter().flat_map(|part| &part.chains).map(|chain| chain.length);
        let length = lengths.fold(f64::INFINITY, f64::min);
        let back: Vec<FaceEdge<'_>> = edges.iter().rev().map(|edge| edge.exchanged()).collect();
        let crossings =
            [crossing(edges, source.point, receiver.point), crossing(&back, receiver.point, source.point)];
        length.is_finite().then_some(Self { length, crossings, parts })
    }

    /// Length of the shortest way over all edges [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Where the way crosses the first and the last edge [m from their starts].
    #[must_use]
    pub fn crossings(&self) -> [f64; 2] {
        self.crossings
    }

    /// The edges whose waves the path is part of, in the order of [`FacePath::amplitudes`].
    pub fn leads(&self) -> impl Iterator<Item = Lead> + '_ {
        self.parts.iter().flat_map(|part| part.chains.iter().map(|chain| chain.lead))
    }

    /// Amplitudes by lead, wave number and wave that the leading edge completes, to be multiplied by e^(−jk length) [1/m].
    #[must_use]
    pub fn amplitudes(&self, numbers: &WaveNumbers) -> Vec<Vec<[Complex; WAVES]>> {
        self.parts.iter().flat_map(|part| part.amplitudes(numbers, self.length)).collect()
    }
}

/// Where the way from the source to the receiver, unfolded about the other edges, crosses the first one [m from its start].
fn crossing(edges: &[FaceEdge<'_>], source: WedgePoint, receiver: WedgePoint) -> f64 {
    let towards = edges.windows(2).rev().fold(receiver, |point, pair| {
        let beyond = pair[1].wedge.beyond(point, pair[1].at_second[0]);
        pair[0].wedge.in_plane(beyond, pair[0].face(1))
    });
    apex(source, towards).clamp(edges[0].part[0], edges[0].part[1])
}

#[cfg(test)]
mod tests;
