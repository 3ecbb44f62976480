//! Open edges: sides of triangles that no other triangle shares, and how two of them lie to one another.

use crate::Mesh;
use crate::topology::SharedEdge;
use glam::DVec3;

/// Directions that differ by less than 10° count as one: its cosine.
pub(crate) const ALIKE: f64 = 0.984_807_753_012_208;

/// An edge as the side of one of its faces, the only one where it is open.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OpenEdge {
    /// Its place among the edges of the mesh.
    pub index: usize,
    /// Its two vertices, the lower index first.
    pub ends: [u32; 2],
    /// Positions of its vertices [m].
    pub points: [DVec3; 2],
    /// The face.
    pub face: u32,
    /// Unit vector from its first end to its second.
    pub along: DVec3,
    /// Unit vector into its face, at right angles to the edge.
    pub inward: DVec3,
    /// Height of its face over it [m].
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

    /// Where a point projects on the edge's line, as the distance from the first end [m].
    pub(crate) fn project(&self, point: DVec3) -> f64 {
        (point - self.points[0]).dot(self.along)
    }

    /// Unit vector along the edge, away from one of its ends.
    pub(crate) fn away_from(&self, end: u32) -> DVec3 {
        if self.ends[0] == end { self.along } else { -self.along }
    }
}
