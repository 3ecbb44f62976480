//! Which triangles meet at which edges.

use crate::Mesh;
use crate::mesh::{MeshTriangle, sides};
use foldhash::HashMap;
use glam::DVec3;
use smallvec::SmallVec;
use std::f64::consts::TAU;

/// The triangles around one edge of a welded mesh.
#[derive(Debug, Clone)]
pub(crate) struct SharedEdge {
    /// Vertices, the lower index first.
    pub ends: [u32; 2],
    /// Triangles with this edge in ascending order.
    pub faces: SmallVec<[u32; 2]>,
    /// Whether it is the rim of a crack.
    pub is_crack: bool,
}

impl SharedEdge {
    /// Unit vector along the edge, from its first end.
    pub(crate) fn along(&self, mesh: &Mesh) -> DVec3 {
        let [from, to] = self.ends.map(|end| mesh.vertices[end as usize]);
        (to - from).normalize()
    }

    /// Whether one of its faces runs along it from the first end to the second, as it is oriented now.
    pub(crate) fn is_ahead(&self, mesh: &Mesh, face: u32) -> bool {
        sides(mesh.triangles[face as usize].corners).contains(&self.ends)
    }

    /// Angle of one of its faces about it, 0 … 2π, from its face `first` on to where normals of faces that run along it point [rad].
    pub(crate) fn turn(&self, mesh: &Mesh, first: u32, face: u32) -> f64 {
        let (origin, inward) = (self.inward(mesh, first), self.inward(mesh, face));
        let quarter = self.along(mesh).cross(origin);
        libm::atan2(inward.dot(quarter), inward.dot(origin)).rem_euclid(TAU)
    }

    /// The vector from the edge to the far corner of one of its faces [m], at right angles to the edge.
    pub(crate) fn height(&self, mesh: &Mesh, face: u32) -> DVec3 {
        let corners = mesh.triangles[face as usize].corners;
        let apex = corners.into_iter().find(|corner| !self.ends.contains(corner)).unwrap_or(self.ends[0]);
        let reach = mesh.vertices[apex as usize] - mesh.vertices[self.ends[0] as usize];
        reach.reject_from_normalized(self.along(mesh))
    }

    /// Unit vector in one of its faces, at right angles to the edge and away from it.
    pub(crate) fn inward(&self, mesh: &Mesh, face: u32) -> DVec3 {
        self.height(mesh, face).normalize_or_zero()
    }
}

/// Edges in the order in which triangles first name them.
pub(crate) fn shared_edges(mesh: &Mesh) -> Vec<SharedEdge> {
    edges_where(mesh, |_| true)
}

/// Those with a number of faces that `is_asked` for. Sides are sorted, because a table of millions of edges fits no cache; as one number
/// each, because these are compared without branches.
pub(crate) fn edges_where(mesh: &Mesh, is_asked: impl Fn(usize) -> bool) -> Vec<SharedEdge> {
    let named = mesh.triangles.iter().flat_map(MeshTriangle::sides).zip(0..);
    let number = |([low, high], side): ([u32; 2], u32)| {
        u128::from(low) << 64 | u128::from(high) << 32 | u128::from(side)
    };
    let mut sides: Vec<u128> = named.map(number).collect();
    sides.sort_unstable();
    let edge = |sides: &[u128]| {
        let ends = [64, 32].map(|place| (sides[0] >> place) as u32);
        let faces = sides.iter().map(|side| *side as u32 / 3).collect();
        (sides[0] as u32, SharedEdge { ends, faces, is_crack: false })
    };
    let shared = sides.chunk_by(|a, b| a >> 32 == b >> 32).filter(|sides| is_asked(sides.len()));
    let mut edges: Vec<(u32, SharedEdge)> = shared.map(edge).collect();
    edges.sort_unstable_by_key(|(first, _)| *first);
    edges.into_iter().map(|(_, edge)| edge).collect()
}

/// Takes faces out of edges, and edges that have no others.
pub(crate) fn leave_out(edges: &mut Vec<SharedEdge>, is_left_out: &[bool]) {
    edges.iter_mut().for_each(|edge| edge.faces.retain(|face| !is_left_out[*face as usize]));
    edges.retain(|edge| !edge.faces.is_empty());
}

/// Disjoint sets of the numbers below a count, with path halving.
pub struct Connected(Vec<u32>);

impl Connected {
    /// Sets of one member each.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// The representative of a set: its lowest member.
    pub fn root(&mut self, mut member: u32) -> u32 {
        while self.0[member as usize] != member {
            let parent = self.0[member as usize];
            self.0[member as usize] = self.0[parent as usize];
            member = self.0[member as usize];
        }
        member
    }

    /// Some members by their sets, in the order of the sets' first ones.
    pub fn groups(&mut self, members: impl IntoIterator<Item = u32>) -> Vec<Vec<u32>> {
        let mut known: HashMap<u32, usize> = HashMap::default();
        let mut groups: Vec<Vec<u32>> = Vec::new();
        for member in members {
            let group = *known.entry(self.root(member)).or_insert(groups.len());
            groups.resize_with(groups.len().max(group + 1), Vec::new);
            groups[group].push(member);
        }
        groups
    }

    /// Unites the sets of two members.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
