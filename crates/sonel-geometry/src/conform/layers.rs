//! Faces that coincide: of those drawn in one place one remains, or two where they are faces of different bodies.
//!
//! Two coinciding faces are kept where a solid stands flush against a wall or another solid, or a panel has two sides: at most
//! of their rim an even number of faces meets at every side then. Where a face lies on another without being part of a body,
//! as a carpet on a floor or a second drawing of a wall, an odd number meets along most of its rim; so the uppermost layer of a
//! patch of coinciding faces is left out as long as that makes more of its rim even than odd.

use crate::Mesh;
use crate::surfaces::PARALLEL;
use crate::topology::{Connected, SharedEdge, shared_edges};
use foldhash::{HashMap, HashSet};
use smallvec::SmallVec;

/// Faces in one place, in the order in which they were drawn.
type Stack = SmallVec<[u32; 2]>;

/// Leaves out what is drawn more than once; the first of several coinciding faces remains. Returns the pairs that do, and the area left
/// out [m²].
///
/// `drawn` is the place of each triangle's whole among those drawn.
pub(super) fn unite(mesh: &mut Mesh, drawn: &[u32]) -> (Vec<[u32; 2]>, f64) {
    let mut stacks: HashMap<[u32; 3], Stack> = HashMap::default();
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let mut corners = triangle.corners;
        corners.sort_unstable();
        stacks.entry(corners).or_default().push(index as u32);
    }
    stacks.retain(|_, faces| faces.len() > 1);
    if stacks.is_empty() {
        return (Vec::new(), 0.0);
    }
    let mut stacks: Vec<Stack> = stacks.into_values().collect();
    stacks.iter_mut().for_each(|faces| faces.sort_by_key(|&face| (drawn[face as usize], face)));
    stacks.sort_unstable();
    let mut layers = Layers::new(mesh, stacks);
    layers.leave_out_carpets();
    let mut is_out = layers.is_out;
    let mut twins: Vec<[u32; 2]> = Vec::new();
    for faces in layers.stacks {
        let kept = 2 - faces.len() % 2;
        faces[kept..].iter().for_each(|&face| is_out[face as usize] = true);
        twins.extend((kept == 2).then(|| [faces[0], faces[1]]));
    }
    let left_out = (0..).zip(&is_out).filter(|(_, is_out)| **is_out);
    let area = left_out.map(|(face, _)| mesh.vector_area(face).length()).sum();
    let mut remaining = 0;
    let names: Vec<u32> =
        is_out.iter().map(|is_out| (remaining, remaining += u32::from(!is_out)).0).collect();
    let mut index = 0;
    mesh.triangles.retain(|_| {
        index += 1;
        !is_out[index - 1]
    });
    (twins.into_iter().map(|pair| pair.map(|face| names[face as usize])).collect(), area)
}

/// Stacks of faces, gathered into patches.
struct Layers<'a> {
    mesh: &'a Mesh,
    stacks: Vec<Stack>,
    edges: Vec<SharedEdge>,
    /// For each patch its stacks and the edges at which an odd number of them meets.
    patches: Vec<(Vec<u32>, Vec<u32>)>,
    is_out: Vec<bool>,
}

impl<'a> Layers<'a> {
    /// Gathers stacks that share edges and have faces of the same materials, or as many faces where walls meet that were drawn twice.
    fn new(mesh: &'a Mesh, stacks: Vec<Stack>) -> Self {
        let edges = shared_edges(mesh);
        let mut of_face: HashMap<u32, u32> = HashMap::default();
        for (stack, faces) in (0..).zip(&stacks) {
            faces.iter().for_each(|&face| {
                of_face.insert(face, stack);
            });
        }
        let kind = |stack: u32| -> SmallVec<[u32; 2]> {
            let faces = stacks[stack as usize].iter();
            faces.map(|&face| mesh.triangles[face as usize].material).collect()
        };
        let mut connected = Connected::new(stacks.len());
        let mut at_edge: Vec<SmallVec<[u32; 2]>> = Vec::with_capacity(edges.len());
        for edge in &edges {
            let mut meeting: SmallVec<[u32; 2]> =
                edge.faces.iter().filter_map(|face| of_face.get(face).copied()).collect();
            meeting.sort_unstable();
            meeting.dedup();
            for (at, &stack) in meeting.iter().enumerate() {
                for &other in &meeting[at + 1..] {
                    let is_corner = meeting.len() == 2
                        && kind(stack).len() == kind(other).len()
                        && edge.faces.len() == kind(stack).len() + kind(other).len()
                        && !is_flat(mesh, edge, [stack, other].map(|it| stacks[it as usize][0]));
                    if is_corner || kind(stack) == kind(other) {
                        connected.join(stack, other);
                    }
                }
            }
            at_edge.push(meeting);
        }
        let mut patches: Vec<(Vec<u32>, Vec<u32>)> = vec![(Vec::new(), Vec::new()); stacks.len()];
        for stack in 0..stacks.len() as u32 {
            patches[connected.root(stack) as usize].0.push(stack);
        }
        for (edge, meeting) in (0..).zip(&at_edge) {
            let mut roots: SmallVec<[u32; 2]> = meeting.iter().map(|&stack| connected.root(stack)).collect();
            roots.sort_unstable();
            for same in roots.chunk_by(|a, b| a == b).filter(|same| same.len() % 2 == 1) {
                patches[same[0] as usize].1.push(edge);
            }
        }
        patches.retain(|(stacks, _)| !stacks.is_empty());
        Self { mesh, stacks, edges, patches, is_out: vec![false; mesh.triangles.len()] }
    }

    /// Leaves out layers as long as that makes rims even.
    fn leave_out_carpets(&mut self) {
        loop {
            let mut order: Vec<(f64, usize)> =
                (0..self.patches.len()).map(|patch| (self.gain(patch), patch)).collect();
            order.retain(|(gain, _)| *gain > 0.0);
            order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let Some(&(_, best)) = order.first() else { return };
            // One may spoil another, so the gain is looked at again.
            for (_, patch) in order {
                if patch == best || self.gain(patch) > 0.0 {
                    self.leave_out_layer(patch);
                }
            }
        }
    }

    /// Length of the rim of a patch at which the number of faces becomes even without its uppermost layer, less that at which it becomes
    /// odd [m].
    fn gain(&self, patch: usize) -> f64 {
        let (stacks, rim) = &self.patches[patch];
        if self.stacks[stacks[0] as usize].len() < 2 {
            return 0.0;
        }
        let change = |&edge: &u32| {
            let edge = &self.edges[edge as usize];
            let count = edge.faces.iter().filter(|&&face| !self.is_out[face as usize]).count();
            let [from, to] = edge.ends.map(|end| self.mesh.vertices[end as usize]);
            from.distance(to) * if count % 2 == 1 { 1.0 } else { -1.0 }
        };
        rim.iter().map(change).sum()
    }

    /// Leaves out the last face of every stack of a patch that has the material of an earlier one, or else the last.
    fn leave_out_layer(&mut self, patch: usize) {
        for &stack in &self.patches[patch].0 {
            let faces = &mut self.stacks[stack as usize];
            let mut known = HashSet::default();
            let again: Vec<bool> = faces
                .iter()
                .map(|&face| !known.insert(self.mesh.triangles[face as usize].material))
                .collect();
            let last = again.iter().rposition(|again| *again).unwrap_or(faces.len() - 1);
            self.is_out[faces.remove(last) as usize] = true;
        }
    }
}

/// Whether two faces continue one another in one plane.
pub(super) fn is_flat(mesh: &Mesh, edge: &SharedEdge, faces: [u32; 2]) -> bool {
    let [a, b] = faces.map(|face| edge.inward(mesh, face));
    a.dot(b) < -PARALLEL
}
