//! Ways over several edges, each joined to the next by a face: over two edges of one, and about solids over three.

use std::sync::Arc;

use glam::DVec3;
use sonel_diffraction::Wedge;
use sonel_diffraction::face::Orders;

use super::RoomEdge;

/// More ways than this over two edges are no barriers, panels and boxes but a tessellated hall, where they would cost more than all else: then
/// it has none of them. The concert hall among the scenes has 213 over two edges without the corners of solids, and 834 with them.
pub(crate) const LIMIT: usize = 1024;
/// The same of ways over three edges, from face to face.
const LONGER_LIMIT: usize = 256;
/// The same of ways over three edges of one face.
const ALONG_LIMIT: usize = 512;
/// How far two places are apart that are one corner, and beyond a line that counts as on it [m].
pub(crate) const CORNER: f64 = 1e-6;

/// Edges that sound passes one after the other, in either direction.
#[derive(Debug, Clone)]
pub(crate) struct Passage {
    pub edges: Vec<Passed>,
    /// The rims of the sheet that all are of, where that is not convex [m].
    pub outline: Arc<[[DVec3; 2]]>,
    /// Edges apart that hide its first edge from the source, or its last one from the receiver, where no way goes on over them.
    pub hidden_by: [Arc<[usize]>; 2],
    /// The same of edges that mirrors end at.
    pub borders: [Arc<[Wedge]>; 2],
}

/// An edge that is passed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Passed {
    pub edge: usize,
    /// Whether the face from the edge before is its second one, and whether that to the next edge is.
    pub at_second: [bool; 2],
}

/// An edge of a face: index of the edge, and which of its faces it is.
pub(crate) type Border = (usize, usize);

/// Whether no edge of a face reaches beyond another one of it.
pub(crate) fn is_convex(edges: &[RoomEdge], face: &[Border]) -> bool {
    face.iter().all(|&one| face.iter().all(|&other| is_within(edges, one, other)))
}

/// All passages among `edges` over `faces`, and which of them there are: none where they are too many, and none over the corners of solids where
/// they are with those.
pub(crate) fn passages(edges: &[RoomEdge], faces: &[Vec<Border>]) -> (Vec<Passage>, Orders) {
    let mut orders = Orders { most: 1, along_a_face: false };
    let (mut passages, mut corners) = (Vec::new(), Vec::new());
    for face in faces {
        let is_convex = is_convex(edges, face);
        let rims = face.iter().map(|&(edge, _)| ends(&edges[edge]));
        let outline: Arc<[[DVec3; 2]]> = if is_convex { Arc::default() } else { rims.collect() };
        for (count, &one) in face.iter().enumerate() {
            for &other in &face[..count] {
                let [first, second] = [one, other].map(|(edge, _)| &edges[edge]);
                if first.wedge.is_rim() && second.wedge.is_rim() {
                    // The sides of a sheet are two faces, and what goes over both is counted once.
                    let is_known = passages.iter().any(|known| joins(known, [one.0, other.0]));
                    if !is_known && reaches(first, second) && reaches(second, first) {
                        passages.push(Passage::new([one, other], outline.clone()));
                    }
                } else if first.wedge.across(&second.wedge).is_some() {
                    passages.push(Passage::new([one, other], Arc::default()));
                } else if is_convex && corners.len() <= LIMIT {
                    corners.push(Passage::new([one, other], Arc::default()));
                }
                if passages.len() > LIMIT {
                    return (Vec::new(), orders);
                }
            }
        }
    }
    if passages.len() + corners.len() <= LIMIT {
        passages.extend(corners);
    }
    orders.most = 2;
    let [from_face_to_face, along_faces] = over_three(edges, &passages);
    if from_face_to_face.len() <= LONGER_LIMIT {
        orders.most = 3;
        passages.extend(from_face_to_face);
        if along_faces.len() <= ALONG_LIMIT {
            orders.along_a_face = !along_faces.is_empty();
            passages.extend(along_faces);
        }
    }
    (passages, orders)
}

/// All passages over three edges of solids whose parts over two are among `pairs`: from face to face, and along one face. Those of each that are
/// more than are wanted are not all there.
fn over_three(edges: &[RoomEdge], pairs: &[Passage]) -> [Vec<Passage>; 2] {
    let of_solids = |pair: &&Passage| pair.edges.iter().any(|passed| !edges[passed.edge].wedge.is_rim());
    let pairs: Vec<&Passage> = pairs.iter().filter(of_solids).collect();
    let mut longer = [Vec::new(), Vec::new()];
    for (count, one) in pairs.iter().enumerate() {
        for other in &pairs[..=count] {
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let (near, far) = (one.edges[i], other.edges[j]);
                let along = usize::from(near.at_second == far.at_second);
                if near.edge == far.edge && longer[along].len() <= [LONGER_LIMIT, ALONG_LIMIT][along] {
                    let middle = Passed { edge: near.edge, at_second: [near.at_second[0], far.at_second[0]] };
                    let edges = vec![one.edges[1 - i], middle, other.edges[1 - j]];
                    longer[along].push(Passage {
                        edges,
                        outline: Arc::default(),
                        hidden_by: Default::default(),
                        borders: Default::default(),
                    });
                }
            }
        }
    }
    longer
}

impl Passage {
    /// Whether it goes over three edges of one face.
    #[must_use]
    pub fn is_along_a_face(&self) -> bool {
        self.edges.len() > 2 && self.edges[1].at_second[0] == self.edges[1].at_second[1]
    }

    /// The way back.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let mut back = self.clone();
        back.edges.reverse();
        back.edges.iter_mut().for_each(|passed| passed.at_second.reverse());
        back.hidden_by.reverse();
        back.borders.reverse();
        back
    }

    fn new(borders: [Border; 2], outline: Arc<[[DVec3; 2]]>) -> Self {
        let passed = borders.map(|(edge, face)| Passed { edge, at_second: [face == 1; 2] });
        Self { edges: passed.to_vec(), outline, hidden_by: Default::default(), borders: Default::default() }
    }
}

fn joins(passage: &Passage, edges: [usize; 2]) -> bool {
    passage.edges.iter().map(|passed| passed.edge).eq(edges)
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
    let corner = |end: DVec3| ends(&edges[j]).iter().any(|other| end.distance(*other) <= CORNER);
    one.faces_with(other) && (one.surface == other.surface || ends(&edges[i]).into_iter().any(corner))
}

/// Whether an edge is on the face's side of a border of it.
fn is_within(edges: &[RoomEdge], (border, face): Border, (other, _): Border) -> bool {
    let wedge = &edges[border].wedge;
    let inward = wedge.inward(face == 1);
    ends(&edges[other]).into_iter().all(|end| (end - wedge.at(0.0)).dot(inward) >= -CORNER)
}

/// Whether any of the rim `to` is on the sheet's side of the rim `from`.
fn reaches(from: &RoomEdge, to: &RoomEdge) -> bool {
    let inward = from.wedge.inward(false);
    ends(to).into_iter().any(|end| (end - from.wedge.at(0.0)).dot(inward) > CORNER)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;
    use sonel_geometry::{Geometry, Mesh, MeshTriangle};

    /// Passages over two edges and over three of an open mesh of rectangles.
    fn counts(rectangles: &[[DVec3; 4]]) -> [usize; 2] {
        let mut mesh = Mesh::default();
        for corners in rectangles {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(corners);
            let triangles = [[0, 1, 2], [0, 2, 3]].map(|corners: [u32; 3]| corners.map(|c| first + c));
            mesh.triangles.extend(triangles.map(|corners| MeshTriangle { corners, material: 0 }));
        }
        let edges = super::super::room_edges(&Geometry::build(mesh).unwrap());
        let (found, _) = passages(&edges, &faces(&edges));
        [2, 3].map(|count| found.iter().filter(|passage| passage.edges.len() == count).count())
    }

    fn rectangle([y0, y1]: [f64; 2], [z0, z1]: [f64; 2]) -> [DVec3; 4] {
        [dvec3(0.0, y0, z0), dvec3(0.0, y1, z0), dvec3(0.0, y1, z1), dvec3(0.0, y0, z1)]
    }

    /// Boxes without a floor, seen from outside: four edges about the top and four upright ones.
    fn covers(count: u32) -> Vec<[DVec3; 4]> {
        (0..count)
            .flat_map(|place| {
                let at = |i: usize, z: f64| {
                    let corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.7], [0.0, 0.7]][i % 4];
                    dvec3(corner[0], corner[1] + 3.0 * f64::from(place), z)
                };
                let sides = (0..4).map(move |i| [at(i, 0.0), at(i + 1, 0.0), at(i + 1, 0.5), at(i, 0.5)]);
                sides.chain([[at(0, 0.5), at(1, 0.5), at(2, 0.5), at(3, 0.5)]]).collect::<Vec<_>>()
            })
            .collect()
    }

    #[test]
    fn rims_of_a_sheet_are_joined_where_either_sees_the_other() {
        assert_eq!(counts(&[rectangle([0.0, 2.0], [0.0, 1.0])]), [6, 0]);
        // Of the six rims of an L the two of its notch do not see one another, nor does either see the rim beyond its own line.
        let angled = [rectangle([0.0, 2.0], [0.0, 1.0]), rectangle([0.0, 1.0], [1.0, 2.0])];
        assert_eq!(counts(&angled), [12, 0]);
    }

    #[test]
    fn too_many_passages_are_none() {
        let [two, three] = counts(&covers(1));
        assert!(two > 0 && three > 0, "{two} {three}");
        let many = counts(&covers(80));
        assert_eq!(many[1], 0, "{many:?}");
        assert!(many[0] <= LIMIT, "{many:?}");
    }
}
