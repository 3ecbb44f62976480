//! Pairs of edges that sound goes over one after the other: parallel edges of one face, as those of the top of a thick barrier, and
//! any edges of a convex face or sheet.

use glam::DVec3;

use super::RoomEdge;

/// More pairs than this are no barriers and panels but a tessellated hall, where they would cost more than all else: then none is
/// diffracted twice. The concert hall among the scenes has 213 without the corners of solids, and 834 with them.
const PAIR_LIMIT: usize = 256;
/// Sine [1] and angle [rad] within which edges are parallel, and whole turns; ends as far apart [m] are one corner.
const PARALLEL: f64 = 1e-6;

/// Two edges that sound goes over, in either order.
pub(crate) struct EdgePair {
    /// Index of each, and whether the face is its second one.
    pub edges: [(usize, bool); 2],
    /// What joins them.
    pub joint: Joint,
}

/// How two edges of a face run.
pub(crate) enum Joint {
    /// In parallel over a face of a solid, of this width [m] between their lines.
    Face(f64),
    /// Any way over a convex face, or over both sides of a sheet.
    Corner,
}

/// An edge of a face: index of the edge, and which of its faces it is.
pub(crate) type Border = (usize, usize);

/// Whether no edge of a face reaches beyond another one of it.
pub(crate) fn is_convex(edges: &[RoomEdge], face: &[Border]) -> bool {
    face.iter().all(|&one| face.iter().all(|&other| is_within(edges, one, other)))
}

/// All pairs among `edges` over `faces`: none where they are too many, and none over the corners of solids where they are with those.
pub(crate) fn pairs(edges: &[RoomEdge], faces: &[Vec<Border>]) -> Vec<EdgePair> {
    let (mut pairs, mut corners) = (Vec::new(), Vec::new());
    for face in faces {
        let is_convex = is_convex(edges, face);
        for (count, &(i, of_i)) in face.iter().enumerate() {
            for &(j, of_j) in &face[..count] {
                if pairs.len() > PAIR_LIMIT {
                    return Vec::new();
                }
                let pair = |joint| EdgePair { edges: [(i, of_i == 1), (j, of_j == 1)], joint };
                let of_sheet = edges[i].wedge.is_rim() && edges[j].wedge.is_rim();
                match across(&edges[i], &edges[j]) {
                    Some(width) if !of_sheet => pairs.push(pair(Joint::Face(width))),
                    // The sides of a sheet are two faces, and what goes over both is counted once.
                    _ if of_sheet && is_convex && !pairs.iter().any(|known| joins(known, [i, j])) => {
                        pairs.push(pair(Joint::Corner));
                    }
                    _ if !of_sheet && is_convex && corners.len() <= PAIR_LIMIT => {
                        corners.push(pair(Joint::Corner));
                    }
                    _ => {}
                }
            }
        }
    }
    if pairs.len() + corners.len() <= PAIR_LIMIT {
        pairs.extend(corners);
    }
    pairs
}

fn joins(pair: &EdgePair, edges: [usize; 2]) -> bool {
    pair.edges.map(|(edge, _)| edge) == edges
}

/// The borders of each face: those in one plane, turned to one side, that share surfaces or corners.
pub(crate) fn faces(edges: &[RoomEdge]) -> Vec<Vec<Border>> {
    let plane = |&(edge, face): &Border| edges[edge].faces[face].plane;
    let mut borders: Vec<Border> = (0..edges.len()).flat_map(|edge| [(edge, 0), (edge, 1)]).collect();
    borders.sort_by_key(plane);
    let mut faces = Vec::new();
    for of_plane in borders.chunk_by(|one, other| plane(one) == plane(other)) {
        let mut left = of_plane.to_vec();
        while let Some(first) = left.pop() {
            let mut face = vec![first];
            let mut reached = 0;
            while reached < face.len() {
                let (more, rest) = left.iter().partition(|&&border| touch(edges, face[reached], border));
                face.extend::<Vec<Border>>(more);
                left = rest;
                reached += 1;
            }
            face.sort_unstable();
            faces.push(face);
        }
    }
    faces
}

fn ends(edge: &RoomEdge) -> [DVec3; 2] {
    [edge.wedge.at(0.0), edge.wedge.at(edge.wedge.length())]
}

/// Whether two borders in one plane are of one face.
fn touch(edges: &[RoomEdge], (i, of_i): Border, (j, of_j): Border) -> bool {
    let (one, other) = (&edges[i].faces[of_i], &edges[j].faces[of_j]);
    let corner = |end: DVec3| ends(&edges[j]).iter().any(|other| end.distance(*other) <= PARALLEL);
    one.faces_with(other) && (one.surface == other.surface || ends(&edges[i]).into_iter().any(corner))
}

/// Whether an edge is on the face's side of a border of it.
fn is_within(edges: &[RoomEdge], (border, face): Border, (other, _): Border) -> bool {
    let wedge = &edges[border].wedge;
    let inward = wedge.inward(face == 1);
    ends(&edges[other]).into_iter().all(|end| (end - wedge.at(0.0)).dot(inward) >= -PARALLEL)
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
