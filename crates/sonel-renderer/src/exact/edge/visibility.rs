//! Which part of an edge is visible, and how its sound fades before all of it is hidden.
//!
//! Visible stretches are found at points along the edge and their ends by halving, so that an obstacle that moves across the edge shortens them
//! continuously; what hides less than the distance between two points may go unnoticed. A finite edge is exact for any stretch. A parallel edge
//! of another object hides all of it at once: before it does the sound fades.

use glam::DVec3;
use sonel_diffraction::Wedge;

/// Points at which an edge is looked at, besides its ends.
const POINTS: usize = 17;
/// How far from its ends it is looked at there, as a share of its length: not where other faces begin.
const OFF_THE_ENDS: f64 = 2e-4;
/// Halvings of the distance between two points where a stretch ends: to fractions of a millimetre on an edge of some metres.
const HALVINGS: usize = 12;
/// How much longer a way is over the edge that may hide it than straight where nothing of it is lost [m]: centimetres off the line of sight.
const CLEAR: f64 = 4e-4;
/// What is nearer than this to a line is on it [m].
const TOUCH: f64 = 1e-6;

/// The places at which it is looked at.
pub(super) fn samples(wedge: &Wedge) -> impl Iterator<Item = DVec3> {
    (0..=POINTS + 1).map(|point| wedge.at(share(point) * wedge.length()))
}

/// Where point number `point` is, as a share of the edge's length.
fn share(point: usize) -> f64 {
    match point {
        0 => OFF_THE_ENDS,
        _ if point == POINTS + 1 => 1.0 - OFF_THE_ENDS,
        _ => (point as f64 - 0.5) / POINTS as f64,
    }
}

/// The stretches of an edge, from its start [m], at which `is_visible` holds.
#[must_use]
pub(super) fn stretches(wedge: &Wedge, is_visible: impl Fn(DVec3) -> bool) -> Vec<[f64; 2]> {
    let visible = |share: f64| is_visible(wedge.at(share * wedge.length()));
    let last = POINTS + 1;
    let points: Vec<bool> = (0..=last).map(|point| visible(share(point))).collect();
    let mut stretches = Vec::new();
    let mut next = 0;
    for run in points.chunk_by(|one, other| one == other) {
        let first = next;
        next += run.len();
        if run[0] {
            let from = if first == 0 { 0.0 } else { border(&visible, share(first), share(first - 1)) };
            let to = if next > last { 1.0 } else { border(&visible, share(next - 1), share(next)) };
            stretches.push([from, to].map(|share| share * wedge.length()));
        }
    }
    stretches
}

/// Where between a visible and a hidden place the view ends.
fn border(visible: &impl Fn(f64) -> bool, mut clear: f64, mut hidden: f64) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (clear + hidden);
        if visible(middle) {
            clear = middle;
        } else {
            hidden = middle;
        }
    }
    0.5 * (clear + hidden)
}

/// How much longer the way from one place to another is over an edge than straight [m], and where it crosses the edge.
#[must_use]
pub(super) fn over_edge(wedge: &Wedge, from: DVec3, to: DVec3) -> (f64, DVec3) {
    let along = [from, to].map(|end| (end - wedge.at(0.0)).dot(wedge.direction()));
    let near = from.distance(wedge.at(along[0]));
    let far = to.distance(wedge.at(along[1]));
    let share = if near + far > 0.0 { near / (near + far) } else { 0.5 };
    let place = wedge.at((along[0] + (along[1] - along[0]) * share).clamp(0.0, wedge.length()));
    (from.distance(place) + place.distance(to) - from.distance(to), place)
}

/// What is left of the sound between `place` on an edge and `end`: 0 where one of the edges `hiding` it is about to, 1 where all are well off the
/// line of sight. The rim of a sheet hides nothing of what lies in the plane of the sheet.
#[must_use]
pub(super) fn unobstructed<'a>(place: DVec3, end: DVec3, hiding: impl Iterator<Item = &'a Wedge>) -> f64 {
    let past = |other: &Wedge| {
        let in_plane = other.is_rim()
            && other.locate(place).is_some_and(|at| libm::sin(at.angle).abs() * at.radius <= TOUCH);
        if in_plane { 1.0 } else { smooth(over_edge(other, place, end).0 / CLEAR) }
    };
    hiding.map(past).product()
}

/// From 0 at 0 to 1 at 1, level at both.
#[must_use]
pub(super) fn smooth(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
