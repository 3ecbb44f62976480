//! Which part of an edge source and receiver both see.
//!
//! Seen stretches are found at points along the edge, its ends among them, and their own ends by halving, so that a stretch shrinks
//! continuously to nothing as something moves in front of it; what is hidden between two neighbouring points stays unnoticed. A finite edge is
//! exact for any stretch, and stretches that are cut by an obstacle radiate as if they ended there.

use glam::DVec3;
use sonel_diffraction::Wedge;
use sonel_geometry::Geometry;

use super::chain::Chain;
use super::mirror::{PlaneMirror, reflects};
use super::world::Copy;

/// Points at which an edge is looked at, besides its ends.
const POINTS: usize = 17;
/// How far from its ends it is looked at there, as a share of its length: not where other faces begin.
const OFF_THE_ENDS: f64 = 2e-4;
/// Halvings of the distance between two of them where a stretch ends: what moves in front of an edge of some metres dims it by fractions of a
/// millimetre.
const HALVINGS: usize = 12;

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
    let seen = |share: f64| seen(wedge.at(share * wedge.length()));
    let last = POINTS + 1;
    let share = |point: usize| match point {
        0 => OFF_THE_ENDS,
        _ if point == last => 1.0 - OFF_THE_ENDS,
        _ => (point as f64 - 0.5) / POINTS as f64,
    };
    let points: Vec<bool> = (0..=last).map(|point| seen(share(point))).collect();
    let mut stretches = Vec::new();
    let mut next = 0;
    for run in points.chunk_by(|one, other| one == other) {
        let first = next;
        next += run.len();
        if run[0] {
            let from = if first == 0 { 0.0 } else { border(&seen, share(first), share(first - 1)) };
            let to = if next > last { 1.0 } else { border(&seen, share(next - 1), share(next)) };
            stretches.push([from, to].map(|share| share * wedge.length()));
        }
    }
    stretches
}

/// The longest of `stretches`: a way over several edges takes one of each.
pub(crate) fn longest(stretches: Vec<[f64; 2]>) -> Option<[f64; 2]> {
    stretches.into_iter().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
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
