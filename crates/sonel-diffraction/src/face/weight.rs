//! Weights of the two forms of the product.
//!
//! Each form must count fully where the end for which it is exact crosses the plane beyond its edge, the other one not at
//! all. A path fades
//! where both ends are on the inner side of their edges next to the face: what grazes that is cut off by its other edges.

use super::FaceEdge;
use crate::wedge::WedgePoint;

/// tan ½θ of the angle over the face below which a second edge fades: θ = 11°. Chosen, not measured; doubled, below 23°.
const FADED: f64 = 0.1;

/// Weights of the receiver's form and of the source's over `edges`.
pub(super) fn weights([first, last]: [FaceEdge<'_>; 2], ends: [WedgePoint; 2]) -> [f64; 2] {
    let (source, receiver) = (About::new(&first, ends[0]), About::new(&last, ends[1]));
    // The faces of a solid are joined on one side, where the wave is heard twice, the rims of a sheet on both.
    let of_sheet = first.wedge.is_rim() && last.wedge.is_rim();
    let sides = if of_sheet { 1.0 } else { 0.5 };
    let square_off = |end: About| {
        let off = if of_sheet { end.height() } else { end.off_the_plane() };
        off * off
    };
    let of_receiver = share(square_off(source), square_off(receiver));
    let [near, far] = [source, receiver].map(About::off_the_face);
    let heard = if of_sheet { [far, near] } else { [1.0 - (1.0 - near) * (1.0 - far); 2] };
    [sides * of_receiver * heard[0], sides * (1.0 - of_receiver) * heard[1]]
}

/// A point about an edge, seen from the face that joins the edge to the others.
#[derive(Clone, Copy)]
struct About {
    radius: f64,
    /// From the face [rad].
    angle: f64,
}

impl About {
    fn new(edge: &FaceEdge<'_>, point: WedgePoint) -> Self {
        Self { radius: point.radius, angle: (point.angle - edge.face()).abs() }
    }

    /// How far it is from the plane of the face [m].
    fn height(self) -> f64 {
        self.radius * libm::sin(self.angle)
    }

    /// How far it is from the part of that plane that is beyond the edge [m]: 2 r on the face.
    fn off_the_plane(self) -> f64 {
        2.0 * self.radius * libm::cos(0.5 * self.angle)
    }

    /// 1, but near the face on both of its sides: ½ where tan ½θ is [`FADED`], 0 on it.
    fn off_the_face(self) -> f64 {
        let (sine, cosine) = libm::sincos(0.5 * self.angle);
        sine * sine / (sine * sine + (FADED * cosine) * (FADED * cosine))
    }
}

/// a/(a + b).
fn share(a: f64, b: f64) -> f64 {
    if a + b > 0.0 { a / (a + b) } else { 0.5 }
}
