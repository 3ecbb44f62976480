//! Consistent orientation: across every edge that joins two triangles, and towards the air.
//!
//! Triangles that [are joined](crate::joints) agree, also across cracks.
//! Faces between air and solid are turned so that their normals point into the air. In the open that is what objects have
//! around them; a room that stands there may have air on both sides of its walls.

use crate::Mesh;
use crate::cells::{Cells, Drawing};
use crate::joints::{Joint, joints, unify};
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

/// Turns the second of two faces that coincide against the first, so that each is in front on its side.
fn turn_against(mesh: &mut Mesh, twins: &[[u32; 2]]) {
    for &[first, second] in twins {
        if mesh.vector_area(first).dot(mesh.vector_area(second)) > 0.0 {
            mesh.triangles[second as usize].corners.swap(1, 2);
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
