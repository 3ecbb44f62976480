//! Consistent orientation: across every edge that joins two triangles, and towards the air.
//!
//! Triangles are joined across an edge when it has two faces, or when among more faces exactly two continue one
//! another in the same plane (a screen welded onto a floor does not cut the floor), and across cracks: joined ones agree.
//! Faces between air and solid are turned so that their normals point into the air. In the open that is what objects have
//! around them; a room that stands there may have air on both sides of its walls.

use crate::Mesh;
use crate::cells::{Cells, Drawing};
use crate::topology::{Connected, SharedEdge};
use foldhash::HashMap;
use glam::DVec3;

/// Result of the orientation.
pub(crate) struct Oriented {
    pub cells: Cells,
    /// Edges at which the component of the largest extents is open, as indices of vertices; none in a room or where all are rims of cracks.
    pub open_edges: Vec<[u32; 2]>,
}

/// Finds the cells of a mesh and orients it in place. Triangles that are left out stay as they are: edges must not name them.
pub(crate) fn orient(mesh: &mut Mesh, drawing: &Drawing<'_>) -> Oriented {
    let edges = drawing.edges;
    let mut is_second = vec![false; mesh.triangles.len()];
    drawing.twins.iter().for_each(|&[_, second]| is_second[second as usize] = true);
    let of_edge = |edge: &SharedEdge| joints(mesh, edge, &is_second, drawing.tolerance);
    let mut joints: Vec<Vec<Joint>> = edges.iter().map(of_edge).collect();
    for facing in drawing.cracks {
        let [a, b] = facing.faces;
        joints[facing.rims[0]].push(Joint { a, b, agree: facing.agree(mesh, edges) });
    }
    unify(mesh, &joints);
    turn_against(mesh, drawing.twins);
    let mut cells = Cells::find(mesh, drawing);
    cells.turn_to_air(mesh, drawing.twins);
    let open_edges = if cells.is_room { Vec::new() } else { open_edges(mesh, edges, &joints) };
    Oriented { cells, open_edges }
}

/// Two triangles joined across an edge, and whether they agree in orientation as they are.
#[derive(Clone, Copy)]
pub(crate) struct Joint {
    pub a: u32,
    pub b: u32,
    agree: bool,
}

impl Joint {
    pub(crate) fn new(mesh: &Mesh, edge: &SharedEdge, [a, b]: [u32; 2]) -> Self {
        Self { a, b, agree: edge.is_ahead(mesh, a) != edge.is_ahead(mesh, b) }
    }
}

/// Turns the second of two faces that coincide against the first, so that each is in front on its side.
fn turn_against(mesh: &mut Mesh, twins: &[[u32; 2]]) {
    for &[first, second] in twins {
        if mesh.vector_area(first).dot(mesh.vector_area(second)) > 0.0 {
            mesh.triangles[second as usize].corners.swap(1, 2);
        }
    }
}

/// The pairs of triangles that continue one another across an edge, without those that coincide with an earlier one.
pub(crate) fn joints(mesh: &Mesh, edge: &SharedEdge, is_second: &[bool], tolerance: f64) -> Vec<Joint> {
    let mut rest = edge.faces.clone();
    rest.retain(|face| !is_second[*face as usize]);
    let mut joints = Vec::new();
    if rest.len() > 2 {
        while let Some((i, j)) = continuing_pair(mesh, edge, &rest, tolerance) {
            joints.push(Joint::new(mesh, edge, [rest[i], rest[j]]));
            rest.remove(j);
            rest.remove(i);
        }
    }
    if let [a, b] = rest[..] {
        joints.push(Joint::new(mesh, edge, [a, b]));
    }
    joints
}

/// The first two faces that lie in one plane on opposite sides of the edge.
fn continuing_pair(mesh: &Mesh, edge: &SharedEdge, faces: &[u32], tolerance: f64) -> Option<(usize, usize)> {
    let reach: Vec<_> = faces.iter().map(|&face| edge.height(mesh, face)).collect();
    for i in 0..faces.len() {
        for j in i + 1..faces.len() {
            let height = reach[i].length().min(reach[j].length());
            let flat = reach[i].normalize_or_zero().cross(reach[j].normalize_or_zero()).length() * height;
            if reach[i].dot(reach[j]) < 0.0 && flat <= tolerance {
                return Some((i, j));
            }
        }
    }
    None
}

/// Turns triangles over until joined ones agree, as far as they can.
pub(crate) fn unify(mesh: &mut Mesh, joints: &[Vec<Joint>]) {
    let mut across: Vec<Vec<(u32, bool)>> = vec![Vec::new(); mesh.triangles.len()];
    for joint in joints.iter().flatten() {
        across[joint.a as usize].push((joint.b, joint.agree));
        across[joint.b as usize].push((joint.a, joint.agree));
    }
    let mut flipped: Vec<Option<bool>> = vec![None; mesh.triangles.len()];
    for seed in 0..mesh.triangles.len() {
        if flipped[seed].is_some() {
            continue;
        }
        flipped[seed] = Some(false);
        let mut component = vec![seed];
        let mut next = 0;
        while next < component.len() {
            let here = component[next];
            let turned = flipped[here] == Some(true);
            for &(other, agree) in &across[here] {
                let wanted = turned == agree;
                if flipped[other as usize].is_none() {
                    flipped[other as usize] = Some(wanted);
                    component.push(other as usize);
                }
            }
            next += 1;
        }
        // The majority, by area, stays as it was made.
        let turned: f64 = component
            .iter()
            .map(|&triangle| {
                let area = mesh.vector_area(triangle as u32).length();
                if flipped[triangle] == Some(true) { area } else { -area }
            })
            .sum();
        for &triangle in &component {
            if flipped[triangle] == Some(turned <= 0.0) {
                mesh.triangles[triangle].corners.swap(1, 2);
            }
        }
    }
}

/// Edges with a single face that are no rims of cracks, of the component of joined triangles with the largest extents.
fn open_edges(mesh: &Mesh, edges: &[SharedEdge], joints: &[Vec<Joint>]) -> Vec<[u32; 2]> {
    let mut connected = Connected::new(mesh.triangles.len());
    for joint in joints.iter().flatten() {
        connected.join(joint.a, joint.b);
    }
    let mut bounds: HashMap<u32, (DVec3, DVec3)> = HashMap::default();
    for &face in edges.iter().flat_map(|edge| &edge.faces) {
        let (low, high) =
            bounds.entry(connected.root(face)).or_insert((DVec3::INFINITY, DVec3::NEG_INFINITY));
        for corner in mesh.corners(face) {
            (*low, *high) = (low.min(corner), high.max(corner));
        }
    }
    let extents = bounds.into_iter().map(|(root, (low, high))| ((high - low).length(), root));
    let largest = extents.max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let is_open = |edge: &&SharedEdge| {
        edge.faces.len() == 1
            && !edge.is_crack
            && largest.is_some_and(|(_, root)| connected.root(edge.faces[0]) == root)
    };
    edges.iter().filter(is_open).map(|edge| edge.ends).collect()
}
