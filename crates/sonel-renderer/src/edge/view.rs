//! Which part of an edge source and receiver both see.
//!
//! Seen stretches are found at points along the edge and their ends by halving, so that a stretch shrinks continuously as
//! something moves in front of it; what is hidden between two neighbouring points stays unnoticed. A finite edge is
//! exact for any stretch, and stretches that are cut by an obstacle radiate as if they ended there.

use glam::DVec3;
use sonel_diffraction::Wedge;
use sonel_geometry::{Departure, Geometry};

use super::mirror::{PlaneMirror, reflects};

/// Points at which an edge is looked at.
const POINTS: usize = 9;
/// Halvings of the distance between two of them where a stretch ends: to a thousandth of the edge and less.
const HALVINGS: usize = 8;

/// How far before a mirror, in lifts, an edge's foot on it is looked at.
const OFF_THE_MIRROR: f64 = 16.0;

/// Where a base path begins and ends, unfolded about its mirror if it has one: the source may then be an image, and what of an edge is
/// behind the mirror is the image of what is before it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leg {
    /// Where the sound seems to come from [m].
    pub source: DVec3,
    /// Where it is heard [m].
    pub receiver: DVec3,
    /// The mirror.
    pub mirror: Option<PlaneMirror>,
    /// Whether the source is an image in it.
    pub shown: bool,
}

impl Leg {
    /// Whether the sound of the source reaches `point`.
    pub fn arrives(&self, geometry: &Geometry, point: DVec3) -> bool {
        let Some(mirror) = self.mirror else { return sees(geometry, self.source, point) };
        let (behind, point) = before(geometry, &mirror, point);
        let source = if self.shown { mirror.image(self.source) } else { self.source };
        if behind == self.shown {
            sees(geometry, source, point)
        } else {
            reflects(geometry, &[mirror], source, point)
        }
    }

    /// Whether the sound from `point` reaches the receiver.
    pub fn goes_on(&self, geometry: &Geometry, point: DVec3) -> bool {
        let Some(mirror) = self.mirror else { return sees(geometry, self.receiver, point) };
        let (behind, point) = before(geometry, &mirror, point);
        if behind {
            reflects(geometry, &[mirror], self.receiver, point)
        } else {
            sees(geometry, self.receiver, point)
        }
    }

    /// Unit direction from the receiver to where sound from `point` on the edge seems to come from.
    pub fn towards(&self, point: DVec3) -> DVec3 {
        (point - self.receiver).normalize_or_zero()
    }

    /// Direction in which the sound leaves the source for `point` on the edge [m].
    pub fn leaving(&self, point: DVec3) -> DVec3 {
        match &self.mirror {
            Some(mirror) if self.shown => mirror.image(point) - mirror.image(self.source),
            _ => point - self.source,
        }
    }
}

/// Whether `point` is behind `mirror`, and where it is or has its image before that.
fn before(geometry: &Geometry, mirror: &PlaneMirror, point: DVec3) -> (bool, DVec3) {
    let height = mirror.height(point);
    let least = OFF_THE_MIRROR * f64::from(geometry.lift());
    let lifted = if height.abs() < least { mirror.normal() * (least - height.abs()) } else { DVec3::ZERO };
    if height < 0.0 { (true, mirror.image(point) + lifted) } else { (false, point + lifted) }
}

/// Whether `from` is seen from `point`.
fn sees(geometry: &Geometry, from: DVec3, point: DVec3) -> bool {
    !geometry.is_blocked(Departure::free(from.as_vec3()), point.as_vec3())
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
