//! How much of each of both forms is heard.
//!
//! Each form has to be heard whole where the end for which it is exact crosses the plane beyond its edge, the other one not at all. Where a
//! longer way is left out that would complete a path, the path fades: on the inner side of an edge towards its face, since what grazes it there is
//! cut off by the other edges of the face; and where the last edges of the longest paths come into sight. Where such a path has to fade for one end
//! and to be whole for the other one, the receiver is right: it is receivers that walk.

use std::f64::consts::PI;

use super::{FaceEdge, Orders};
use crate::wedge::{Wedge, WedgePoint};

/// tan ½θ of the angle over the face below which a second edge fades.
const FADED: f64 = 0.1;
/// The same beside the other face of an edge, where it goes out of sight and no third edge completes it: a path over two is too much to
/// be missed farther off.
const OUT_OF_SIGHT: f64 = 0.02;
/// Angle from the plane beyond an edge within which what completes other paths there is heard [rad].
const WIDTH: f64 = PI / 6.0;
/// The same within which a last path is whole for the receiver however the source fades it [rad].
const LAST_WIDTH: f64 = 0.1;
/// Share of a path below which it goes out at the receiver's end for good.
const GOES_OUT: f64 = 0.05;
/// Weights of the receiver's form and of the source's over `edges`, where paths of these `orders` are heard.
pub(super) fn weights(edges: &[FaceEdge<'_>], ends: [WedgePoint; 2], orders: Orders) -> [f64; 2] {
    let (first, last) = (&edges[0], &edges[edges.len() - 1]);
    let (source, receiver) = (About::new(first, 1, ends[0]), About::new(last, 0, ends[1]));
    // The faces of a solid are joined on one side, where the wave is heard twice, the rims of a sheet on both.
    let of_sheet = first.wedge.is_rim() && last.wedge.is_rim();
    let sides = if of_sheet { 1.0 } else { 0.5 };
    let square_off = |end: About<'_>| {
        let off = if of_sheet { end.height() } else { end.off_the_plane() };
        off * off
    };
    let of_receiver = share(square_off(source), square_off(receiver));
    let [near, far] = [source, receiver].map(About::off_the_face);
    let heard = if of_sheet {
        [far, near]
    } else if edges.len() > 2 {
        let heard = last_heard([near * source.in_sight(), far * receiver.in_sight()], [source, receiver]);
        let along_one_face = edges[1].at_second[0] == edges[1].at_second[1];
        let completes = 1.0 - source.beside_the_plane(WIDTH) * receiver.beside_the_plane(WIDTH);
        [if along_one_face { heard * completes } else { heard }; 2]
    } else if orders.most == 2 {
        let left = [near * source.off_the_other_face(), far * receiver.off_the_other_face()];
        [last_heard(left, [source, receiver]); 2]
    } else if orders.along_a_face {
        [1.0 - (1.0 - near) * (1.0 - far); 2]
    } else {
        [last_heard([near, far], [source, receiver]); 2]
    };
    [sides * of_receiver * heard[0], sides * (1.0 - of_receiver) * heard[1]]
}

/// How much is heard of a path that no longer one completes, of which as much as `left` is left at each end. Each end hears it whole in its own
/// plane, whatever fades it at the other one, but for a source's where the receiver's nearly goes out.
fn last_heard(left: [f64; 2], [source, receiver]: [About<'_>; 2]) -> f64 {
    let [of_source, of_receiver] = left;
    let whole_for = |end: About<'_>| 1.0 - end.beside_the_plane(LAST_WIDTH);
    of_source * of_receiver
        + (1.0 - of_source) * of_receiver * whole_for(receiver)
        + (1.0 - of_receiver) * of_source * whole_for(source) * smooth(of_receiver / GOES_OUT)
}

/// A point about an edge, seen from the face that joins the edge to the others.
#[derive(Clone, Copy)]
struct About<'a> {
    wedge: &'a Wedge,
    radius: f64,
    /// From the face [rad].
    angle: f64,
}

impl<'a> About<'a> {
    fn new(edge: &FaceEdge<'a>, side: usize, point: WedgePoint) -> Self {
        Self { wedge: edge.wedge, radius: point.radius, angle: (point.angle - edge.face(side)).abs() }
    }

    /// How far it is from the plane of the face [m].
    fn height(self) -> f64 {
        self.radius * libm::sin(self.angle)
    }

    /// How far it is from the part of that plane that is beyond the edge [m]: 2 r on the face.
    fn off_the_plane(self) -> f64 {
        2.0 * self.radius * libm::cos(0.5 * self.angle)
    }

    /// 1, but near the face on both of its sides, where it is 0.
    fn off_the_face(self) -> f64 {
        off(self.angle, FADED)
    }

    /// 1, but next to the edge's other face, where it is 0.
    fn off_the_other_face(self) -> f64 {
        off(self.wedge.angle() - self.angle, OUT_OF_SIGHT)
    }

    /// 0 in the plane beyond the edge, 1 from an angle of `width` [rad] to it on.
    fn beside_the_plane(self, width: f64) -> f64 {
        smooth((self.angle - PI).abs() / width)
    }

    /// 1 before the plane beyond the edge, and falling behind it to 0 on the edge's other face, where the edge goes out of sight.
    fn in_sight(self) -> f64 {
        smooth((self.wedge.angle() - self.angle) / (self.wedge.angle() - PI))
    }
}

/// 0 at no angle [rad], ½ where tan ½θ is `faded`, and 1 farther off.
fn off(angle: f64, faded: f64) -> f64 {
    let (sine, cosine) = libm::sincos(0.5 * angle);
    sine * sine / (sine * sine + (faded * cosine) * (faded * cosine))
}

/// From 0 at 0 to 1 at 1, level at both.
pub(super) fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// a/(a + b).
fn share(a: f64, b: f64) -> f64 {
    if a + b > 0.0 { a / (a + b) } else { 0.5 }
}
