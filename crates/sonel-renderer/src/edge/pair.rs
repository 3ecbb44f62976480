//! Pairs of edges that sound goes over one after the other: parallel edges of one face, as those of the top of a thick barrier, and
//! rims of a sheet.

use std::f64::consts::TAU;

use glam::DVec3;

use super::RoomEdge;

/// More pairs than this are no barriers and panels but a tessellated hall, where they would cost more than all else: then none is
/// diffracted twice. The concert hall among the scenes has 206.
const PAIR_LIMIT: usize = 256;
/// Sine [1] and angle [rad] within which edges are parallel, and whole turns; ends as far apart [m] are one corner.
const PARALLEL: f64 = 1e-6;

/// Two edges that sound goes over, in either order.
pub(crate) struct EdgePair {
    /// Index of each, and whether it has as its second face what joins them: of sheets, the first face of the first edge.
    pub edges: [(usize, bool); 2],
    /// What joins them.
    pub joint: Joint,
}

/// What joins two edges.
pub(crate) enum Joint {
    /// A face of a solid, of this width [m] between their lines.
    Face(f64),
    /// Both sides of a sheet.
    Sheet,
}

/// All pairs among `edges`; none where they are too many.
pub(crate) fn pairs(edges: &[RoomEdge]) -> Vec<EdgePair> {
    let (rims, solid): (Vec<usize>, Vec<usize>) = (0..edges.len()).partition(|&edge| is_rim(&edges[edge]));
    let mut pairs = Vec::new();
    for sheet in sheets(edges, &rims) {
        for (count, &i) in sheet.iter().enumerate() {
            for &j in &sheet[..count] {
                if pairs.len() >= PAIR_LIMIT {
                    return Vec::new();
                }
                let turned = !edges[i].faces[0].faces_with(&edges[j].faces[0]);
                pairs.push(EdgePair { edges: [(i, false), (j, turned)], joint: Joint::Sheet });
            }
        }
    }
    for (count, &i) in solid.iter().enumerate() {
        for &j in &solid[..count] {
            if pairs.len() > PAIR_LIMIT {
                return Vec::new();
            }
            let Some(width) = across(&edges[i], &edges[j]) else { continue };
            pairs.extend(joints(&edges[i], &edges[j]).map(|faces| EdgePair {
                edges: [(i, faces[0] == 1), (j, faces[1] == 1)],
                joint: Joint::Face(width),
            }));
        }
    }
    pairs
}

fn is_rim(edge: &RoomEdge) -> bool {
    edge.wedge.angle() > TAU - PARALLEL
}

/// The `rims` of each convex sheet: those in one plane that share surfaces or corners.
fn sheets(edges: &[RoomEdge], rims: &[usize]) -> Vec<Vec<usize>> {
    let mut left = rims.to_vec();
    let mut sheets = Vec::new();
    while let Some(first) = left.pop() {
        let mut sheet = vec![first];
        let mut reached = 0;
        while reached < sheet.len() {
            let (more, rest) = left.iter().partition(|&&rim| touch(&edges[sheet[reached]], &edges[rim]));
            sheet.extend::<Vec<usize>>(more);
            left = rest;
            reached += 1;
        }
        if sheet.iter().all(|&rim| sheet.iter().all(|&other| is_within(&edges[rim], &edges[other]))) {
            sheets.push(sheet);
        }
    }
    sheets
}

fn ends(edge: &RoomEdge) -> [DVec3; 2] {
    [edge.wedge.at(0.0), edge.wedge.at(edge.wedge.length())]
}

/// Whether two rims in one plane are of one sheet.
fn touch(first: &RoomEdge, second: &RoomEdge) -> bool {
    let (one, other) = (&first.faces[0], &second.faces[0]);
    let corner = |end: DVec3| ends(second).iter().any(|other| end.distance(*other) <= PARALLEL);
    one.plane == other.plane && (one.surface == other.surface || ends(first).into_iter().any(corner))
}

/// Whether `other` is on the sheet's side of `rim`.
fn is_within(rim: &RoomEdge, other: &RoomEdge) -> bool {
    ends(other).into_iter().all(|end| (end - rim.wedge.at(0.0)).dot(rim.wedge.inward()) >= -PARALLEL)
}

/// The distance between two edges that lie beside one another, in parallel [m].
fn across(first: &RoomEdge, second: &RoomEdge) -> Option<f64> {
    let (a, b) = (&first.wedge, &second.wedge);
    if a.direction().cross(b.direction()).length() > PARALLEL {
        return None;
    }
    let along = |point: DVec3| (point - a.at(0.0)).dot(a.direction());
    let (low, high) = (along(b.at(0.0)), along(b.at(b.length())));
    if low.max(high) <= 0.0 || low.min(high) >= a.length() {
        return None;
    }
    Some((b.at(0.0) - a.at(0.0)).reject_from_normalized(a.direction()).length())
}

/// The faces by which two edges are joined.
fn joints<'a>(first: &'a RoomEdge, second: &'a RoomEdge) -> impl Iterator<Item = [usize; 2]> + 'a {
    let same = |&[i, j]: &[usize; 2]| {
        let (one, other) = (&first.faces[i], &second.faces[j]);
        one.surface == other.surface && one.faces_with(other)
    };
    [[0, 0], [0, 1], [1, 0], [1, 1]].into_iter().filter(same)
}
