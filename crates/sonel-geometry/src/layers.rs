//! Layers: of faces that were drawn in one place one remains, or two where each is the wall of the air on its side.
//!
//! Two bodies touch in a patch of such faces if it ends where one cell gives way to another; where it ends and all else goes on the
//! second face is a carpet, or a part of the wall that was drawn again, and the first counts. Where a solid touches a wall
//! the face is seen that continues beside it: the wall. Between air and air two faces of different materials both remain: a panel,
//! or the walls of two rooms.

use crate::Mesh;
use crate::cells::{Cells, Drawing, Known};
use crate::cracks::{Facing, find_cracks};
use crate::surfaces::PARALLEL;
use crate::topology::{Connected, SharedEdge, leave_out, shared_edges};
use foldhash::HashMap;
use glam::DVec3;
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// Faces in one place, in the order in which they were drawn.
pub(crate) type Stack = SmallVec<[u32; 2]>;

/// Remains of faces that coincide.
#[derive(Default)]
pub(crate) struct Layers {
    /// Pairs of faces that coincide, the first one drawn first.
    pub twins: Vec<[u32; 2]>,
    /// Whether two bodies touch in each face; empty where none do.
    pub is_doubled: Vec<bool>,
    /// What was drawn again and left out, by the materials.
    pub redrawn: Vec<Redrawn>,
}

/// Faces that were drawn where others are, and left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Redrawn {
    /// Materials of the faces that count, which were drawn first, and of those that were left out.
    pub materials: [u32; 2],
    /// Area [m²].
    pub area: f64,
    /// Its centroid, in world coordinates [m].
    pub center: DVec3,
}

/// Patches: stacks of faces that continue one another in one plane and have the same materials.
struct Patches<'a> {
    mesh: &'a Mesh,
    stacks: &'a [Stack],
    /// The stack of a face.
    of_face: HashMap<u32, u32>,
    /// All edges with all faces.
    edges: &'a [SharedEdge],
    cells: &'a Cells,
}

/// Evidence at the rim of a patch.
#[derive(Clone, Default)]
struct RimEvidence {
    layers: usize,
    /// Length at which a layer ends where one cell gives way to another [m].
    contact: f64,
    /// Length at which a layer ends and all else goes on [m].
    drawn_again: f64,
    /// Length at which the patch continues in each material [m].
    continued: HashMap<u32, f64>,
}

/// Faces that coincide, each in the order of `drawn`, the places of the triangles' wholes among those drawn.
pub(crate) fn stacks(mesh: &Mesh, drawn: &[u32]) -> Vec<Stack> {
    let mut stacks: HashMap<[u32; 3], Stack> = HashMap::default();
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let mut corners = triangle.corners;
        corners.sort_unstable();
        stacks.entry(corners).or_default().push(index as u32);
    }
    let mut stacks: Vec<Stack> = stacks.into_values().filter(|faces| faces.len() > 1).collect();
    stacks.iter_mut().for_each(|faces| faces.sort_by_key(|&face| (drawn[face as usize], face)));
    stacks.sort_unstable();
    stacks
}

/// Leaves out what is drawn more than once; `is_interface` tells borders between airs by their material, positions within `tolerance` [m]
/// are the same.
pub(crate) fn unite(
    mesh: &mut Mesh,
    stacks: &[Stack],
    is_interface: impl Fn(u32) -> bool,
    known: Known<'_>,
    tolerance: f64,
) -> Layers {
    if stacks.is_empty() {
        return Layers::default();
    }
    let edges = shared_edges(mesh);
    let is_left_out: Vec<bool> = mesh.triangles.iter().map(|it| is_interface(it.material)).collect();
    let first_ones = FirstOnes::new(mesh, edges.clone(), stacks, is_left_out, known, tolerance);
    let of_face =
        (0..).zip(stacks).flat_map(|(at, faces)| faces.iter().map(move |&face| (face, at))).collect();
    let patches = Patches { mesh, stacks, of_face, edges: &edges, cells: &first_ones.cells(&[]) };
    let rims = patches.rims();
    let mut is_doubled = vec![false; mesh.triangles.len()];
    for (faces, rim) in stacks.iter().zip(&rims) {
        is_doubled[faces[0] as usize] = rim.is_contact();
    }
    let cells = first_ones.cells(&is_doubled);
    let kept: Vec<Stack> =
        stacks.iter().zip(&rims).map(|(faces, rim)| kept(mesh, &cells, faces, rim)).collect();
    let mut is_out = vec![false; mesh.triangles.len()];
    let mut redrawn: BTreeMap<[u32; 2], (f64, DVec3)> = BTreeMap::new();
    for (faces, kept) in stacks.iter().zip(&kept) {
        faces.iter().filter(|face| !kept.contains(face)).for_each(|&face| is_out[face as usize] = true);
        kept.iter().for_each(|&face| is_doubled[face as usize] = is_doubled[faces[0] as usize]);
        let drawn_again = faces.len().saturating_sub(kept.len() + cells.solids(faces[0]));
        let is_seen = cells.is_air(faces[0]) != [false; 2];
        let left_out = faces.iter().rev().find(|face| !kept.contains(face));
        if let Some(&left_out) = left_out.filter(|_| drawn_again > 0 && is_seen) {
            let materials = [faces[0], left_out].map(|face| mesh.triangles[face as usize].material);
            let area = drawn_again as f64 * mesh.vector_area(faces[0]).length();
            let center = mesh.corners(left_out).iter().sum::<DVec3>() / 3.0;
            let sum = redrawn.entry(materials).or_default();
            *sum = (sum.0 + area, sum.1 + area * center);
        }
    }
    let redrawn = redrawn.into_iter().map(|(materials, (area, moment))| Redrawn {
        materials,
        area,
        center: moment / area,
    });
    let redrawn = redrawn.collect();
    let twins = kept.iter().filter(|kept| kept.len() == 2).map(|pair| [pair[0], pair[1]]).collect();
    let mut layers = Layers { twins, is_doubled, redrawn };
    layers.leave_out(mesh, &is_out);
    layers
}

impl Layers {
    /// Leaves faces out of a mesh.
    pub(crate) fn leave_out(&mut self, mesh: &mut Mesh, is_out: &[bool]) {
        let mut left = 0;
        let names: Vec<u32> = is_out.iter().map(|is_out| (left, left += u32::from(!is_out)).0).collect();
        self.twins.retain(|pair| !pair.iter().any(|&face| is_out[face as usize]));
        self.twins.iter_mut().flatten().for_each(|face| *face = names[*face as usize]);
        let mut outs = is_out.iter();
        mesh.triangles.retain(|_| outs.next() == Some(&false));
        let mut outs = is_out.iter();
        self.is_doubled.retain(|_| outs.next() == Some(&false));
    }
}

/// A mesh with the first faces of its stacks alone.
struct FirstOnes<'a> {
    mesh: &'a Mesh,
    edges: Vec<SharedEdge>,
    cracks: Vec<Facing>,
    is_left_out: Vec<bool>,
    known: Known<'a>,
    tolerance: f64,
}

impl<'a> FirstOnes<'a> {
    fn new(
        mesh: &'a Mesh,
        mut edges: Vec<SharedEdge>,
        stacks: &[Stack],
        mut is_left_out: Vec<bool>,
        known: Known<'a>,
        tolerance: f64,
    ) -> Self {
        stacks.iter().flat_map(|faces| &faces[1..]).for_each(|&face| is_left_out[face as usize] = true);
        leave_out(&mut edges, &is_left_out);
        let cracks = find_cracks(mesh, &mut edges, tolerance);
        Self { mesh, edges, cracks, is_left_out, known, tolerance }
    }

    fn cells(&self, is_doubled: &[bool]) -> Cells {
        let drawing = Drawing {
            edges: &self.edges,
            cracks: &self.cracks,
            is_left_out: &self.is_left_out,
            is_doubled,
            known: self.known,
            tolerance: self.tolerance,
            ..Drawing::default()
        };
        Cells::find(self.mesh, &drawing)
    }
}

impl RimEvidence {
    /// Whether two bodies touch in the patch.
    fn is_contact(&self) -> bool {
        self.contact >= self.drawn_again || self.layers > 2 && self.contact > 0.0
    }
}

/// The faces of a stack that remain.
fn kept(mesh: &Mesh, cells: &Cells, faces: &Stack, rim: &RimEvidence) -> Stack {
    let material = |face: u32| mesh.triangles[face as usize].material;
    let first = faces[0];
    if cells.is_air(first) == [true; 2] {
        let other = faces.iter().copied().find(|&face| material(face) != material(first));
        let pair = other.filter(|_| rim.is_contact()).map(|other| [first, other]);
        return pair.map_or(SmallVec::from_slice(&[first]), |pair| SmallVec::from_slice(&pair));
    }
    let continued = |face: u32| rim.continued.get(&material(face)).copied().unwrap_or(0.0);
    let more = |best, face| if continued(face) > continued(best) { face } else { best };
    let seen = if cells.solids(first) == 1 { faces.iter().copied().reduce(more) } else { None };
    SmallVec::from_slice(&[seen.unwrap_or(first)])
}

impl Patches<'_> {
    /// For each stack the rim of its patch: of the part between two cells, or where that has no evidence of the whole.
    fn rims(&self) -> Vec<RimEvidence> {
        let [parts, wholes] = [true, false].map(|is_part| self.rims_of(&self.connected(is_part)));
        let has_evidence = |rim: &RimEvidence| rim.contact + rim.drawn_again > 0.0;
        parts
            .into_iter()
            .zip(wholes)
            .map(|(part, whole)| if has_evidence(&part) { part } else { whole })
            .collect()
    }

    /// For each stack the rim of the patch that it is in.
    fn rims_of(&self, patches: &[u32]) -> Vec<RimEvidence> {
        let mut rims: HashMap<u32, RimEvidence> = HashMap::default();
        for edge in self.edges {
            self.add_edge(edge, patches, &mut rims);
        }
        patches.iter().map(|patch| rims.get(patch).cloned().unwrap_or_default()).collect()
    }

    fn material(&self, face: u32) -> u32 {
        self.mesh.triangles[face as usize].material
    }

    fn materials(&self, stack: u32) -> SmallVec<[u32; 2]> {
        self.stacks[stack as usize].iter().map(|&face| self.material(face)).collect()
    }

    /// Number of the layers that a face is one of.
    fn layers(&self, face: u32) -> usize {
        self.of_face.get(&face).map_or(1, |&stack| self.stacks[stack as usize].len())
    }

    /// The patch of each stack, by its lowest stack, or the part of it between the same cells.
    fn connected(&self, is_part: bool) -> Vec<u32> {
        let mut connected = Connected::new(self.stacks.len());
        for edge in self.edges {
            let meeting = self.meeting(edge);
            for (at, &one) in meeting.iter().enumerate() {
                for &other in &meeting[at + 1..] {
                    let ends = [one, other].map(|it| self.stacks[it as usize][0]);
                    let is_joined = self.materials(one) == self.materials(other)
                        && (!is_part || self.pair(ends[0]) == self.pair(ends[1]));
                    if is_joined && is_flat(self.mesh, edge, ends) {
                        connected.join(one, other);
                    }
                }
            }
        }
        (0..self.stacks.len() as u32).map(|stack| connected.root(stack)).collect()
    }

    /// The stacks at an edge.
    fn meeting(&self, edge: &SharedEdge) -> SmallVec<[u32; 4]> {
        let mut meeting: SmallVec<[u32; 4]> =
            edge.faces.iter().filter_map(|face| self.of_face.get(face).copied()).collect();
        meeting.sort_unstable();
        meeting.dedup();
        meeting
    }

    /// Notes what an edge says of the patches whose rim it is.
    fn add_edge(&self, edge: &SharedEdge, patches: &[u32], rims: &mut HashMap<u32, RimEvidence>) {
        let meeting = self.meeting(edge);
        let [from, to] = edge.ends.map(|end| self.mesh.vertices[end as usize]);
        let length = from.distance(to);
        for &stack in &meeting {
            let is_rim =
                meeting.iter().filter(|&&it| patches[it as usize] == patches[stack as usize]).count() % 2
                    == 1;
            if !is_rim {
                continue;
            }
            let rim = rims.entry(patches[stack as usize]).or_default();
            let face = self.stacks[stack as usize][0];
            rim.layers = self.layers(face);
            let beyond = edge.faces.iter().copied().filter(|other| self.of_face.get(other) != Some(&stack));
            for other in beyond.filter(|&other| is_flat(self.mesh, edge, [face, other])) {
                // Where another face of the same patch of layers begins none of them ends.
                if self.layers(other) < rim.layers {
                    let is_same = self.pair(face) == self.pair(other);
                    *(if is_same { &mut rim.drawn_again } else { &mut rim.contact }) += length;
                }
                *rim.continued.entry(self.material(other)).or_default() += length;
            }
        }
    }

    /// The cells on both sides of a face, the lower first.
    fn pair(&self, face: u32) -> [u32; 2] {
        let first = self.of_face.get(&face).map_or(face, |&stack| self.stacks[stack as usize][0]);
        let [front, back] = self.cells.sides(first);
        [front.min(back), front.max(back)]
    }
}

/// Whether two faces continue one another in one plane.
pub(crate) fn is_flat(mesh: &Mesh, edge: &SharedEdge, faces: [u32; 2]) -> bool {
    let [a, b] = faces.map(|face| edge.inward(mesh, face));
    a.dot(b) < -PARALLEL
}
