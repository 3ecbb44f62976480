//! Pairs of parallel convex edges of one face, as those of the top of a thick barrier.

use std::f64::consts::TAU;

use super::RoomEdge;

/// More pairs than this are no barriers but a tessellated hall, where they would cost more than all else: then none is diffracted
/// twice. The concert hall among the scenes has 206.
const PAIR_LIMIT: usize = 256;
/// Rims of a sheet that are as many times longer as far apart count as a pair.
const LONG: f64 = 2.0;
/// Sine [1] and angle [rad] within which edges are parallel, and whole turns.
const PARALLEL: f64 = 1e-6;

/// Two parallel edges of one face.
pub(crate) struct EdgePair {
    /// Index of each, and whether the face is its second one.
    pub edges: [(usize, bool); 2],
    /// Distance between their lines [m].
    pub width: f64,
}

/// All pairs among `edges`; none where they are too many.
pub(crate) fn pairs(edges: &[RoomEdge]) -> Vec<EdgePair> {
    let mut pairs = Vec::new();
    for (i, first) in edges.iter().enumerate() {
        for (j, second) in edges.iter().enumerate().take(i) {
            if pairs.len() > PAIR_LIMIT {
                return Vec::new();
            }
            let Some(width) = across(first, second).filter(|&width| counts([first, second], width)) else {
                continue;
            };
            pairs.extend(
                joints(first, second)
                    .map(|faces| EdgePair { edges: [(i, faces[0] == 1), (j, faces[1] == 1)], width }),
            );
        }
    }
    pairs
}

/// Whether two edges at a distance of `width` [m] say what is diffracted twice: those of a thick obstacle, and opposite rims of a
/// sheet that are long enough for its other rims, which are diffracted once, to say little.
fn counts(edges: [&RoomEdge; 2], width: f64) -> bool {
    let is_rim = |edge: &RoomEdge| edge.wedge.angle() > TAU - PARALLEL;
    let is_long = |edge: &RoomEdge| edge.wedge.length() >= LONG * width;
    edges.iter().all(|edge| !is_rim(edge)) || edges.iter().all(|edge| is_rim(edge) && is_long(edge))
}

/// The distance between two edges that lie beside one another, in parallel [m].
fn across(first: &RoomEdge, second: &RoomEdge) -> Option<f64> {
    let (a, b) = (&first.wedge, &second.wedge);
    if a.direction().cross(b.direction()).length() > PARALLEL {
        return None;
    }
    let along = |point: glam::DVec3| (point - a.at(0.0)).dot(a.direction());
    let (low, high) = (along(b.at(0.0)), along(b.at(b.length())));
    if low.max(high) <= 0.0 || low.min(high) >= a.length() {
        return None;
    }
    Some((b.at(0.0) - a.at(0.0)).reject_from_normalized(a.direction()).length())
}

/// The faces by which two edges are joined: one, or both sides of a sheet.
fn joints<'a>(first: &'a RoomEdge, second: &'a RoomEdge) -> impl Iterator<Item = [usize; 2]> + 'a {
    let same = |&[i, j]: &[usize; 2]| {
        let (one, other) = (&first.faces[i], &second.faces[j]);
        one.surface == other.surface && one.faces_with(other)
    };
    [[0, 0], [0, 1], [1, 0], [1, 1]].into_iter().filter(same)
}
