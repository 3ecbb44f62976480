//! Pairs of parallel convex edges of one face, as those of the top of a thick barrier.

use std::f64::consts::TAU;

use super::RoomEdge;

/// More pairs than this are no barrier but a tessellated hall: then none is diffracted twice.
const PAIR_LIMIT: usize = 32;
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
            pairs.extend(
                joined(first, second).map(|(faces, width)| EdgePair {
                    edges: [(i, faces[0] == 1), (j, faces[1] == 1)],
                    width,
                }),
            );
        }
    }
    pairs
}

/// The faces by which two edges are joined, and the distance between them [m].
fn joined(first: &RoomEdge, second: &RoomEdge) -> Option<([usize; 2], f64)> {
    let (a, b) = (&first.wedge, &second.wedge);
    let convex = a.angle() < TAU - PARALLEL && b.angle() < TAU - PARALLEL;
    if !convex || a.direction().cross(b.direction()).length() > PARALLEL {
        return None;
    }
    let along = |point: glam::DVec3| (point - a.at(0.0)).dot(a.direction());
    let (low, high) = (along(b.at(0.0)), along(b.at(b.length())));
    if low.max(high) <= 0.0 || low.min(high) >= a.length() {
        return None;
    }
    let width = (b.at(0.0) - a.at(0.0)).reject_from_normalized(a.direction()).length();
    let same = |&[i, j]: &[usize; 2]| {
        let (one, other) = (&first.faces[i], &second.faces[j]);
        one.surface == other.surface && one.faces_with(other)
    };
    [[0, 0], [0, 1], [1, 0], [1, 1]].into_iter().find(same).map(|faces| (faces, width))
}
