//! Pairs of edges of one convex face, which sound passes one after the other.

use std::collections::HashSet;

use glam::DVec3;
use rayon::prelude::*;
use sonel_diffraction::Wedge;

use super::RoomEdge;
use super::bodies::Bodies;
use super::mirror::Mirror;

/// Distance up to which positions are one corner or on a line [m]: conforming meshes share corners, the rest is rounding.
const CORNER: f64 = 1e-6;
/// Most pairs for each edge of a face; outlines of more than twice as many edges, such as round ones, have none. Chosen, not measured; doubled,
/// outlines of up to 64 edges have up to 2016 pairs.
const PAIRS_PER_EDGE: usize = 16;

/// Two edges of a convex face, or of a convex sheet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub edges: [usize; 2],
    /// Whether the common face is the second one of each edge.
    pub at_second: [bool; 2],
}

impl Pair {
    /// In the other direction.
    #[must_use]
    fn reversed(self) -> Self {
        let [one, other] = self.edges;
        let [first, second] = self.at_second;
        Self { edges: [other, one], at_second: [second, first] }
    }
}

/// An edge of a face: index of the edge, and which of its faces it is.
type Border = (usize, usize);

/// All pairs of edges of convex faces.
fn pairs(edges: &[RoomEdge]) -> Vec<Pair> {
    let mut pairs: Vec<Pair> = Vec::new();
    for face in faces(edges).iter().filter(|face| is_convex(edges, face)) {
        if face.len() > 2 * PAIRS_PER_EDGE {
            continue;
        }
        for (count, &one) in face.iter().enumerate() {
            for &other in &face[..count] {
                let both = [one, other];
                let is_sheet = both.iter().all(|(edge, _)| edges[*edge].wedge.is_rim());
                let indices = both.map(|(edge, _)| edge);
                // The sides of a sheet are two faces, and what goes over both is counted once.
                let is_known = || pairs.iter().any(|pair| pair.edges == indices);
                if indices[0] != indices[1] && !(is_sheet && is_known()) {
                    pairs.push(Pair { edges: indices, at_second: both.map(|(_, face)| face == 1) });
                }
            }
        }
    }
    pairs
}

/// The edges of each face: those in one plane, turned to one side, that share surfaces or corners.
fn faces(edges: &[RoomEdge]) -> Vec<Vec<Border>> {
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

/// Whether no edge of a face reaches beyond another one of it.
fn is_convex(edges: &[RoomEdge], face: &[Border]) -> bool {
    face.iter().all(|&one| face.iter().all(|&other| is_within(edges, one, other)))
}

fn ends(edge: &RoomEdge) -> [DVec3; 2] {
    [0.0, edge.wedge.length()].map(|along| edge.wedge.at(along))
}

/// Whether two borders in one plane are of one face.
fn touch(edges: &[RoomEdge], (i, of_i): Border, (j, of_j): Border) -> bool {
    let (one, other) = (&edges[i].faces[of_i], &edges[j].faces[of_j]);
    let corner = |end: DVec3| ends(&edges[j]).iter().any(|other| end.distance(*other) <= CORNER);
    one.is_coplanar_with(other) && (one.surface == other.surface || ends(&edges[i]).into_iter().any(corner))
}

/// Whether an edge is on the face's side of a border of it.
fn is_within(edges: &[RoomEdge], (border, face): Border, (other, _): Border) -> bool {
    let wedge = &edges[border].wedge;
    let inward = wedge.inward(face == 1);
    ends(&edges[other]).into_iter().all(|end| (end - wedge.at(0.0)).dot(inward) >= -CORNER)
}

/// What sound may pass between two edges: nothing, or a floor that it meets.
pub(super) struct Joined {
    pub floor: Option<Mirror>,
    /// Pairs of edges of faces, in either direction.
    pub pairs: Vec<Pair>,
    /// The other edges that sound may pass after each edge: both have a part in front of one another.
    pub partners: Vec<Vec<usize>>,
}

impl Joined {
    /// `point` as it is seen from the first edge.
    pub(super) fn image(&self, point: DVec3) -> DVec3 {
        self.floor.map_or(point, |floor| floor.image(point))
    }

    /// Both edges as they are seen from the first one.
    pub(super) fn wedges(&self, [first, last]: [&RoomEdge; 2]) -> [Wedge; 2] {
        [first.wedge, self.floor.map_or(last.wedge, |floor| last.wedge.mirrored(|point| floor.image(point)))]
    }

    /// Whether an edge has a part in front of another one.
    fn shows(&self, one: &RoomEdge, other: &RoomEdge) -> bool {
        let is_above = |end: DVec3| self.floor.is_none_or(|floor| floor.height(end) > CORNER);
        ends(other)
            .iter()
            .any(|&end| is_above(end) && one.wedge.locate(self.image(end + other.off)).is_some())
    }

    /// With the partners of all edges, but for the pairs `of_faces`.
    fn with_partners(mut self, edges: &[RoomEdge], of_faces: &HashSet<[usize; 2]>) -> Self {
        let is_partner = |i: usize, j: usize| {
            let both = [&edges[i], &edges[j]];
            self.shows(both[0], both[1]) && self.shows(both[1], both[0]) && !of_faces.contains(&[i, j])
        };
        let later = |i: usize| (i + 1..edges.len()).filter(|&j| is_partner(i, j)).collect();
        let later: Vec<Vec<usize>> = (0..edges.len()).into_par_iter().map(later).collect();
        self.partners = vec![Vec::new(); edges.len()];
        for (i, j) in later.iter().enumerate().flat_map(|(i, later)| later.iter().map(move |&j| (i, j))) {
            self.partners[i].push(j);
            self.partners[j].push(i);
        }
        self
    }
}

/// All that may be between two edges: nothing first, then each of the `floors`.
#[must_use]
pub(super) fn joined(edges: &[RoomEdge], bodies: &Bodies, floors: Vec<Mirror>) -> Vec<Joined> {
    let pairs: Vec<Pair> = pairs(edges).into_iter().flat_map(|pair| [pair, pair.reversed()]).collect();
    let of_faces: HashSet<[usize; 2]> = pairs.iter().map(|pair| pair.edges).collect();
    let over = floors.into_iter().map(|floor| (Some(floor), over_floor(edges, &pairs, bodies, &floor)));
    let all: Vec<_> = over.collect();
    std::iter::once((None, pairs))
        .chain(all)
        .map(|(floor, pairs)| Joined { floor, pairs, partners: Vec::new() }.with_partners(edges, &of_faces))
        .collect()
}

/// Pairs of edges of faces that stand on a floor: those of the face, and each edge with its own image.
fn over_floor(edges: &[RoomEdge], pairs: &[Pair], bodies: &Bodies, floor: &Mirror) -> Vec<Pair> {
    let with_itself =
        |index: usize| [false, true].map(|second| Pair { edges: [index; 2], at_second: [second; 2] });
    let of_sheet = |pair: &Pair| edges[pair.edges[0]].wedge.is_rim() && pair.at_second[0];
    let stands = |pair: &Pair| {
        let face = &edges[pair.edges[0]].faces[usize::from(pair.at_second[0])];
        face.is_across(floor) && bodies.stands_on(face.body, floor.plane)
    };
    let of_one = (0..edges.len()).flat_map(with_itself).filter(|pair| !of_sheet(pair));
    pairs.iter().copied().chain(of_one).filter(stands).collect()
}
