//! Second order over two edges of a flat face, whichever way they run: source, edge, along the face, edge, receiver.
//!
//! Each edge alone takes the face to go on for ever, so that its field steps where a receiver crosses the plane of the face beside it.
//! What it sends along the face reaches the receiver past the next edge as that of a point source on the face would: with D₁ the first
//! edge's field, R′ the receiver turned about the second edge into the plane, P where the way to it crosses the first edge, and D₂
//! the second edge's field of a source at P on the face,
//!
//!   H₂ = ½ D₁(S → R′) D₂(P → R) |P R′| e^(jk |P R′|),
//!
//! ½ because a source on a face is heard twice; the rims of a sheet are joined by both of its sides. In the plane D₂ jumps by twice the
//! free field where the way from P crosses the second edge, and not elsewhere: over all edges of a convex face H₂ jumps as D₁ does,
//! whatever the shape, and no step is left. Beside a sheet, which scatters nothing in its plane, it is −D₁ there. What would run on
//! to a third edge is left out, and with it fades what a receiver near the plane hears over an edge on whose inner side it is.
//!
//! The formula is exact at the receiver's end only. Exchanged, it is exact at the source's: [`FacePath`] takes the mean of both, each
//! weighted by the other end's square height over the plane.
//!
//! Reference: [Svensson1999] for the parts (docs/references.md); measured against boundary elements in docs/diffraction.md.

use crate::complex::Complex;
use crate::edge_path::{EdgePath, Lit, WAVES};
use crate::wedge::{Wedge, WedgePoint, apex};

/// P keeps this share of the length of its edge, and of the way, from the ends of the edge: what a corner sends comes from about it.
const OFF_THE_ENDS: f64 = 0.25;
/// tan ½θ of the angle over the face below which a second edge fades.
const FADED: f64 = 0.1;

/// An edge of a face: of one side of a sheet, or of a solid.
#[derive(Debug, Clone, Copy)]
pub struct FaceEdge<'a> {
    /// The edge.
    pub wedge: &'a Wedge,
    /// Source and receiver about it, where they are in its air.
    pub ends: [Option<WedgePoint>; 2],
    /// Whether the edge alone is heard by them along the face, or from them.
    pub alone: [bool; 2],
    /// Whether the face is its second one.
    pub at_second: bool,
    /// The part of it that is seen, from its start [m].
    pub part: [f64; 2],
}

impl FaceEdge<'_> {
    /// Source and receiver exchanged.
    fn exchanged(mut self) -> Self {
        self.ends.reverse();
        self.alone.reverse();
        self
    }

    /// Angle of the face [rad].
    fn face(&self) -> f64 {
        if self.at_second { self.wedge.angle() } else { 0.0 }
    }

    /// Square height of a point over the face's plane [m²].
    fn square_height(&self, point: WedgePoint) -> f64 {
        let height = point.radius * libm::sin(point.angle - self.face());
        height * height
    }
}

/// A path over two edges of a face.
#[derive(Debug, Clone)]
pub struct FacePath {
    length: f64,
    ways: [OneWay; 2],
}

/// The path as it is exact at one of its ends.
#[derive(Debug, Clone)]
pub struct OneWay {
    first: EdgePath,
    second: EdgePath,
    /// |P R′| [m].
    reach: f64,
    /// Length of the shortest way [m].
    length: f64,
    weight: f64,
    /// The ends of the path over the first edge about that.
    pub ends: [WedgePoint; 2],
}

impl FacePath {
    /// The path over the `first` and then over the `second` edge, for wave numbers of at least `smallest_k` [1/m]. Within the angle
    /// `within` [rad] of the face's plane beyond an edge, the side on which an end counts is that on which the other edge has it.
    /// [`None`] where the source is not in the air of the first edge or the receiver not in that of the second.
    #[must_use]
    pub fn new(first: FaceEdge<'_>, second: FaceEdge<'_>, within: f64, smallest_k: f64) -> Option<Self> {
        let (source, receiver) = (first.ends[0]?, second.ends[1]?);
        let (of_source, of_receiver) = (first.square_height(source), second.square_height(receiver));
        let sum = of_source + of_receiver;
        let weight = |square: f64| if sum > 0.0 { square / sum } else { 0.5 };
        let back = (second.exchanged(), first.exchanged());
        let ways = [
            OneWay::new((first, source), (second, receiver), weight(of_source), within, smallest_k),
            OneWay::new((back.0, receiver), (back.1, source), weight(of_receiver), within, smallest_k),
        ];
        Some(Self { length: ways[0].length.min(ways[1].length), ways })
    }

    /// Length of the shortest way over both edges [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The path as it is exact at the receiver's end, and as it is at the source's: the field is the sum of both.
    #[must_use]
    pub fn ways(&self) -> &[OneWay; 2] {
        &self.ways
    }
}

impl OneWay {
    fn new(
        (first, source): (FaceEdge<'_>, WedgePoint),
        (second, receiver): (FaceEdge<'_>, WedgePoint),
        weight: f64,
        within: f64,
        smallest_k: f64,
    ) -> Self {
        let beyond = second.wedge.beyond(receiver, second.at_second);
        let turned = first.wedge.in_plane(beyond, first.face());
        let margin = OFF_THE_ENDS * (first.part[1] - first.part[0]).min(source.radius + turned.radius);
        let place = apex(source, turned).clamp(first.part[0] + margin, first.part[1] - margin);
        let from = first.wedge.at(place);
        // On which side of the face's plane the receiver is, is for the first edge to say.
        let front = Some(first.alone[1]);
        let faces = if second.at_second { [None, front] } else { [front, None] };
        let lit = Lit { direct: front, faces, within };
        let on_face = second.wedge.in_plane(from, second.face());
        let path = |edge: FaceEdge<'_>, from, to, lit| {
            EdgePath::new(edge.wedge, from, to, edge.part, lit, smallest_k)
        };
        let first_path = path(first, source, turned, Lit::default());
        let second_path = path(second, on_face, receiver, lit);
        let reach = from.distance(beyond);
        let length = first_path.detour() + second_path.detour() - reach;
        // The faces of a solid are joined on one side, where the wave is heard twice.
        let sides = if first.wedge.is_rim() && second.wedge.is_rim() { 1.0 } else { 0.5 };
        let weight = weight * sides * off_the_face(receiver.angle - second.face());
        Self { first: first_path, second: second_path, reach, length, weight, ends: [source, turned] }
    }

    /// Amplitudes at wave number `k` by the wave that the first edge completes, to be multiplied by e^(−jk length) [1/m].
    #[must_use]
    pub fn amplitudes(&self, k: f64, length: f64) -> [Complex; WAVES] {
        let second = self.second.field(k).into_iter().fold(Complex::ZERO, |sum, term| sum + term);
        let factor = second * Complex::unit(k * (self.reach + length)) * (self.reach * self.weight);
        self.first.field(k).map(|term| term * factor)
    }
}

/// 1, but near the face on both of its sides, where it is 0.
fn off_the_face(angle: f64) -> f64 {
    let (sine, cosine) = libm::sincos(0.5 * angle);
    sine * sine / (sine * sine + (FADED * cosine) * (FADED * cosine))
}

#[cfg(test)]
mod tests;
