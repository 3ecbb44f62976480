//! Open edges: sides of triangles that no other triangle shares, and how two of them lie to one another.

use crate::Mesh;
use crate::topology::SharedEdge;
use glam::DVec3;

/// Cosine of 10°, within which directions count as one. Chosen, not measured; doubled, the ends of a wedge-shaped gap are closed too.
pub(crate) const ALIKE: f64 = 0.984_807_753_012_208;

/// An edge as the side of one of its faces, the only one where it is open.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OpenEdge {
    /// Index among the edges of the mesh.
    pub index: usize,
    /// Vertices, the lower index first.
    pub ends: [u32; 2],
    /// Positions of the vertices [m].
    pub points: [DVec3; 2],
    /// The face.
    pub face: u32,
    /// Unit vector from the first end to the second.
    pub along: DVec3,
    /// Unit vector into the face, at right angles to the edge.
    pub inward: DVec3,
    /// Height of the face over the edge [m].
    pub height: f64,
}

/// The open edges of a mesh whose edges are `edges`.
pub(crate) fn open_edges(mesh: &Mesh, edges: &[SharedEdge]) -> Vec<OpenEdge> {
    sides_of_faces(mesh, edges, |faces| faces == 1)
}

/// The sides of faces at those of a mesh's `edges` whose number of faces `is_taken`.
pub(crate) fn sides_of_faces(
    mesh: &Mesh,
    edges: &[SharedEdge],
    is_taken: impl Fn(usize) -> bool,
) -> Vec<OpenEdge> {
    let side = |index: usize, edge: &SharedEdge, face: u32| OpenEdge {
        index,
        ends: edge.ends,
        points: edge.ends.map(|end| mesh.vertices[end as usize]),
        face,
        along: edge.along(mesh),
        inward: edge.inward(mesh, face),
        height: edge.height(mesh, face).length(),
    };
    let taken = edges.iter().enumerate().filter(|(_, edge)| is_taken(edge.faces.len()));
    taken.flat_map(|(index, edge)| edge.faces.iter().map(move |&face| side(index, edge, face))).collect()
}

impl OpenEdge {
    /// Length [m].
    pub(crate) fn length(&self) -> f64 {
        self.points[0].distance(self.points[1])
    }

    /// The point at a distance `along` from the first end [m].
    pub(crate) fn at(&self, along: f64) -> DVec3 {
        self.points[0] + along * self.along
    }

    /// Distance from the first end to the projection of a point on the edge's line [m].
    pub(crate) fn project(&self, point: DVec3) -> f64 {
        (point - self.points[0]).dot(self.along)
    }

    /// Unit vector along the edge, away from one of its ends.
    pub(crate) fn away_from(&self, end: u32) -> DVec3 {
        if self.ends[0] == end { self.along } else { -self.along }
    }
}
