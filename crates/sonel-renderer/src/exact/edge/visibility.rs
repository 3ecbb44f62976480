//! Which part of an edge is visible, and past what.
//!
//! Visible stretches are found at points along the edge and their ends by halving, so that an obstacle that moves across the edge shortens them
//! continuously; what hides less than the distance between two points may go unnoticed. A finite edge is exact for any stretch.

use glam::DVec3;
use sonel_diffraction::Wedge;

/// Points at which the visibility of an edge is tested, besides its ends. Chosen, not measured: stretches shorter than a seventeenth may be
/// missed; doubled, a thirty-fourth at twice the time.
const POINTS: usize = 17;
/// Distance of the outer test points from the ends of the edge, as a share of its length [1]: 1 mm on 5 m, off the faces at its ends. Chosen,
/// not measured.
const OFF_THE_ENDS: f64 = 2e-4;
/// Halvings of the distance between two points where a stretch ends: to fractions of a millimetre on an edge of some metres.
const HALVINGS: usize = 12;

/// Position of point number `point` as a share of the edge's length.
fn share(point: usize) -> f64 {
    match point {
        0 => OFF_THE_ENDS,
        _ if point == POINTS + 1 => 1.0 - OFF_THE_ENDS,
        _ => (point as f64 - 0.5) / POINTS as f64,
    }
}

/// The stretches of an edge, from its start [m], by what `look` tells of their places, where that is anything.
#[must_use]
pub(super) fn stretches<T: PartialEq + Clone>(
    wedge: &Wedge,
    look: impl Fn(DVec3) -> Option<T>,
) -> Vec<(T, Vec<[f64; 2]>)> {
    let seen = |share: f64| look(wedge.at(share * wedge.length()));
    let points: Vec<Option<T>> = (0..=POINTS + 1).map(|point| seen(share(point))).collect();
    let mut stretches: Vec<(T, Vec<[f64; 2]>)> = Vec::new();
    let (mut from, mut next) = (0.0, 0);
    for run in points.chunk_by(|one, other| one == other) {
        next += run.len();
        let to = match points.get(next) {
            Some(_) => border(|at| seen(at) == run[0], share(next - 1), share(next)),
            None => 1.0,
        };
        let part = [from, to].map(|share| share * wedge.length());
        from = to;
        let Some(what) = &run[0] else { continue };
        match stretches.iter_mut().find(|(known, _)| known == what) {
            Some((_, parts)) => parts.push(part),
            None => stretches.push((what.clone(), vec![part])),
        }
    }
    stretches
}

/// Between two places, where what is seen at the first one ends.
fn border(is_same: impl Fn(f64) -> bool, mut same: f64, mut other: f64) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (same + other);
        *if is_same(middle) { &mut same } else { &mut other } = middle;
    }
    0.5 * (same + other)
}

/// Point of an edge on the shortest path between two positions [m].
#[must_use]
pub(super) fn nearest(wedge: &Wedge, from: DVec3, to: DVec3) -> DVec3 {
    let along = [from, to].map(|end| (end - wedge.at(0.0)).dot(wedge.direction()));
    let near = from.distance(wedge.at(along[0]));
    let far = to.distance(wedge.at(along[1]));
    let share = if near + far > 0.0 { near / (near + far) } else { 0.5 };
    wedge.at((along[0] + (along[1] - along[0]) * share).clamp(0.0, wedge.length()))
}

/// From 0 at 0 to 1 at 1, level at both.
#[must_use]
pub(super) fn smooth(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
