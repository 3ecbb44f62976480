//! The path over two edges of a face, unfolded into its plane.

use glam::DVec3;

use super::{End, FaceEdge};
use crate::wedge::{WedgePoint, apex};

/// Least distance of two positions that are not one [m]; it keeps quotients finite.
const SHORTEST: f64 = 1e-6;

/// A way along a face from an edge past the next one.
#[derive(Debug, Clone, Copy)]
pub(super) struct FaceWay {
    /// P, where it comes from the first edge [m].
    pub lights: DVec3,
    /// P about the second edge.
    pub near: WedgePoint,
    /// R′ [m].
    pub to: DVec3,
    /// The way from P to where it crosses the line of the second edge, and from there to R′ [m].
    pub lengths: [f64; 2],
    crosses: DVec3,
}

impl FaceWay {
    /// The way from what is at `from` about the edge `before` to the receiver past the edge `last`.
    pub(super) fn new([before, last]: [&FaceEdge<'_>; 2], from: WedgePoint, receiver: End) -> Self {
        let to = last.beyond(receiver);
        let lights = before.lights(from, before.wedge.in_plane(to, before.face()));
        let near = last.wedge.in_plane(lights, last.face());
        let crosses = last.wedge.at(apex(near, receiver.point));
        let lengths = [lights.distance(crosses).max(SHORTEST), crosses.distance(to)];
        Self { lights, near, to, lengths, crosses }
    }

    /// a of the way between both edges, so that it is a cosh η long over two places of theirs [m].
    pub(super) fn across(&self, edges: [&FaceEdge<'_>; 2]) -> f64 {
        let way = (self.crosses - self.lights).normalize_or_zero();
        edges.iter().fold(self.lengths[0], |length, edge| length * way.cross(edge.wedge.direction()).length())
    }

    /// Where the sound would come from, about the `last` edge, if it came straight from the source, and how far that is beyond P [m].
    pub(super) fn afar(&self, [before, last]: [&FaceEdge<'_>; 2], source: End) -> (WedgePoint, f64) {
        let source =
            before.wedge.at(source.point.along) - before.wedge.inward(before.at_second) * source.point.radius;
        let longer = source.distance(self.lights);
        let place = self.crosses.lerp(self.lights, 1.0 + longer / self.lengths[0]);
        (last.wedge.in_plane(place, last.face()), longer)
    }
}
