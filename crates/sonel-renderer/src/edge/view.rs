//! Which part of an edge source and receiver both see.
//!
//! Seen stretches are found at points along the edge and their ends by halving, so that a stretch shrinks continuously as
//! something moves in front of it; what is hidden between two neighbouring points stays unnoticed. A finite edge is
//! exact for any stretch, and stretches that are cut by an obstacle radiate as if they ended there.

use glam::DVec3;
use sonel_diffraction::Wedge;
use sonel_geometry::Geometry;

use super::chain::Chain;
use super::mirror::{PlaneMirror, reflects};
use super::world::Copy;

/// Points at which an edge is looked at.
const POINTS: usize = 9;
/// Halvings of the distance between two of them where a stretch ends: to a thousandth of the edge and less.
const HALVINGS: usize = 8;

/// How far before a mirror, in lifts, an edge's foot on it is looked at.
const OFF_THE_MIRROR: f64 = 16.0;

/// How far off an edge, in lifts, a place on it looks at another edge.
const OFF_THE_EDGE: f64 = 16.0;

/// Where a base path begins and ends, unfolded about the mirrors that show it: the source may then be an image, and what of an edge is
/// in another copy of the room than the receiver is the image of one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leg<'a> {
    /// Where the sound seems to come from [m].
    pub source: DVec3,
    /// Where it comes from [m].
    pub origin: DVec3,
    /// Where it is heard [m].
    pub receiver: DVec3,
    /// The mirrors that show the source.
    pub shown: &'a Chain,
}

impl Leg<'_> {
    /// Whether the sound of the source reaches `point` in `copy`.
    pub fn arrives(&self, geometry: &Geometry, copy: &Copy, point: DVec3) -> bool {
        let mirrors = &copy.before;
        mirrors.reaches(geometry, self.origin, copy.seen(geometry, point))
    }

    /// Whether the sound from `point` in `copy` reaches the receiver.
    pub fn goes_on(&self, geometry: &Geometry, copy: &Copy, point: DVec3) -> bool {
        copy.behind.reaches(geometry, self.receiver, copy.seen(geometry, point))
    }

    /// Unit direction from the receiver to where sound from `point` on the edge seems to come from.
    pub fn towards(&self, point: DVec3) -> DVec3 {
        (point - self.receiver).normalize_or_zero()
    }

    /// Direction in which the sound leaves the source for `point` on the edge [m].
    pub fn leaving(&self, point: DVec3) -> DVec3 {
        self.shown.reversed().image(point) - self.origin
    }
}

impl Copy {
    /// The place in the room of which `point` is the image, off the mirrors beside it.
    pub fn seen(&self, geometry: &Geometry, point: DVec3) -> DVec3 {
        let least = OFF_THE_MIRROR * f64::from(geometry.lift());
        self.beside.iter().fold(self.behind.image(point), |point, mirror| {
            point + mirror.normal() * (least - mirror.height(point)).max(0.0)
        })
    }
}

/// Whether two places on edges see one another, each with its direction into the air of its edge and the copy of the room that it is in,
/// over the mirror between the copies if they are two.
pub(crate) fn joined(
    geometry: &Geometry,
    between: Option<&PlaneMirror>,
    places: [(&Copy, DVec3, DVec3); 2],
) -> bool {
    let off = OFF_THE_EDGE * f64::from(geometry.lift());
    let [one, other] = places.map(|(copy, place, into_air)| copy.seen(geometry, place + into_air * off));
    reflects(geometry, between.map_or(&[], std::slice::from_ref), one, other)
}

/// The stretches of an edge, from its start [m], of which `seen` holds.
pub(crate) fn stretches(wedge: &Wedge, seen: impl Fn(DVec3) -> bool) -> Vec<[f64; 2]> {
    let at = |share: f64| share * wedge.length();
    let seen = |share: f64| seen(wedge.at(at(share)));
    let share = |point: usize| (point as f64 + 0.5) / POINTS as f64;
    let points: Vec<bool> = (0..POINTS).map(|point| seen(share(point))).collect();
    let mut stretches = Vec::new();
    let mut first = None;
    for point in 0..=POINTS {
        match (first, points.get(point).copied().unwrap_or(false)) {
            (None, true) if point == 0 => first = Some(end(&seen, share(0), 0.0)),
            (None, true) => first = Some(border(&seen, share(point), share(point - 1))),
            (Some(from), false) => {
                let to = if point == POINTS {
                    end(&seen, share(point - 1), 1.0)
                } else {
                    border(&seen, share(point - 1), share(point))
                };
                stretches.push([at(from), at(to)]);
                first = None;
            }
            _ => {}
        }
    }
    stretches
}

/// Where between a clear and a hidden place the view ends.
fn border(seen: &impl Fn(f64) -> bool, mut clear: f64, mut hidden: f64) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (clear + hidden);
        if seen(middle) {
            clear = middle;
        } else {
            hidden = middle;
        }
    }
    0.5 * (clear + hidden)
}

/// How far a stretch reaches towards the edge's `end` beyond its outermost point.
fn end(seen: &impl Fn(f64) -> bool, point: f64, end: f64) -> f64 {
    // Not the very end, where other faces begin.
    let last = end + (point - end) * libm::ldexp(1.0, -(HALVINGS as i32));
    if seen(last) { end } else { border(seen, point, end) }
}
