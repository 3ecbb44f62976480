//! Triangles that continue one another across an edge, and their common orientation.
//!
//! They are joined when the edge has two faces, or when among more faces exactly two continue one another in the same plane: a
//! screen welded onto a floor does not cut the floor.

use crate::Mesh;
use crate::topology::SharedEdge;

/// Two triangles joined across an edge, and whether they agree in orientation as they are.
#[derive(Clone, Copy)]
pub(crate) struct Joint {
    pub a: u32,
    pub b: u32,
    pub agree: bool,
}

impl Joint {
    pub(crate) fn new(mesh: &Mesh, edge: &SharedEdge, [a, b]: [u32; 2]) -> Self {
        Self { a, b, agree: edge.is_ahead(mesh, a) != edge.is_ahead(mesh, b) }
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
