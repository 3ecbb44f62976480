//! Consistent orientation: across every edge that joins two triangles, and towards the air.
//!
//! Triangles are joined across an edge when it has two faces, or when among more faces exactly two continue one
//! another in the same plane (a screen welded onto a floor does not cut the floor), and across cracks. Components whose
//! every edge is joined are closed shells if their cracks are below a thousandth of their area. The scene is a room if one of them holds all the rest. Then a shell within an even number of
//! others is a room and faces inward, one within an odd number is an object and faces outward, so that the normals point to
//! the air between them. In the open it is the other way round: what stands there is an object. But a room of which only a
//! corner pokes out looks the same, and the source may be in it: there is air on both sides of every shell then.

use crate::Mesh;
use crate::cracks::Facing;
use crate::enclosure::signed_volume;
use crate::nesting::{Shell, nesting_depths};
use crate::topology::{Connected, SharedEdge};

/// A shell is closed if its cracks have at most this share of its area.
pub(crate) const LARGEST_CRACKED_SHARE: f64 = 1e-3;

/// What orientation found: shells and which triangles belong to one.
pub(crate) struct Oriented {
    /// Closed shells, in the order of their lowest triangle.
    pub shells: Vec<Shell>,
    /// For each triangle whether it is part of a closed shell.
    pub in_shell: Vec<bool>,
    /// The shell that holds everything else.
    pub room: Option<usize>,
    /// Edges at which the component of the largest extents is open, as indices of vertices; none where that is a closed shell
    /// or all are rims of cracks.
    pub open_edges: Vec<[u32; 2]>,
}

/// Orients the mesh in place.
/// Triangles for which `is_interface` tells so are left as they are: `edges` must not name them.
pub(crate) fn orient(
    mesh: &mut Mesh,
    edges: &[SharedEdge],
    cracks: &[Facing],
    is_interface: &[bool],
    tolerance: f64,
) -> Oriented {
    let mut joints: Vec<Vec<Joint>> = edges.iter().map(|edge| joints(mesh, edge, tolerance)).collect();
    for &Facing { rims, faces: [a, b], agree, .. } in cracks {
        joints[rims[0]].push(Joint { a, b, agree });
    }
    let orientable = unify(mesh, &joints);
    let Components { closed, open_edges } =
        components(mesh, edges, cracks, &joints, &orientable, is_interface);
    let mut shells: Vec<Shell> = closed
        .into_iter()
        .map(|triangles| Shell { volume: signed_volume(mesh, &triangles), triangles, depth: 0 })
        .collect();
    for (shell, depth) in nesting_depths(mesh, &shells).into_iter().enumerate() {
        shells[shell].depth = depth;
    }
    let room = room(mesh, &shells, tolerance);
    let mut in_shell = vec![false; mesh.triangles.len()];
    for shell in &mut shells {
        for &triangle in &shell.triangles {
            in_shell[triangle as usize] = true;
        }
        let is_object = (shell.depth % 2 == 1) == room.is_some();
        // A positive signed volume means that the normals point out of the shell.
        let inside_out = (shell.volume > 0.0) != is_object;
        if inside_out && !is_flat(mesh, shell, tolerance) {
            for &triangle in &shell.triangles {
                mesh.triangles[triangle as usize].corners.swap(1, 2);
            }
        }
        shell.volume = shell.volume.abs();
    }
    Oriented { shells, in_shell, room, open_edges }
}

/// The outermost shell whose bounds contain everything else.
fn room(mesh: &Mesh, shells: &[Shell], tolerance: f64) -> Option<usize> {
    let bounds = mesh.bounds();
    shells.iter().position(|shell| {
        let (low, high) = mesh.bounds_of(&shell.triangles);
        shell.depth == 0
            && (low - bounds.0).max_element() <= tolerance
            && (bounds.1 - high).max_element() <= tolerance
    })
}

/// Whether a shell is but two sheets back to back: it has no inside, and its sheets face where they were made to.
fn is_flat(mesh: &Mesh, shell: &Shell, tolerance: f64) -> bool {
    let area: f64 = shell.triangles.iter().map(|&triangle| mesh.vector_area(triangle).length()).sum();
    shell.volume.abs() <= tolerance * area
}

/// Two triangles joined across an edge, and whether they agree in orientation as they are.
#[derive(Clone, Copy)]
struct Joint {
    a: u32,
    b: u32,
    agree: bool,
}

/// The pairs of triangles that continue one another across an edge.
fn joints(mesh: &Mesh, edge: &SharedEdge, tolerance: f64) -> Vec<Joint> {
    let pair = |a: u32, b: u32| Joint { a, b, agree: edge.is_ahead(mesh, a) != edge.is_ahead(mesh, b) };
    let mut rest = edge.faces.clone();
    let mut joints = Vec::new();
    if rest.len() > 2 {
        while let Some((i, j)) = continuing_pair(mesh, edge, &rest, tolerance) {
            joints.push(pair(rest[i], rest[j]));
            rest.remove(j);
            rest.remove(i);
        }
    }
    if let [a, b] = rest[..] {
        joints.push(pair(a, b));
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

/// Turns triangles over until joined ones agree; tells for each triangle whether its component could be unified.
fn unify(mesh: &mut Mesh, joints: &[Vec<Joint>]) -> Vec<bool> {
    let mut across: Vec<Vec<(u32, bool)>> = vec![Vec::new(); mesh.triangles.len()];
    for joint in joints.iter().flatten() {
        across[joint.a as usize].push((joint.b, joint.agree));
        across[joint.b as usize].push((joint.a, joint.agree));
    }
    let mut flipped: Vec<Option<bool>> = vec![None; mesh.triangles.len()];
    let mut orientable = vec![true; mesh.triangles.len()];
    for seed in 0..mesh.triangles.len() {
        if flipped[seed].is_some() {
            continue;
        }
        flipped[seed] = Some(false);
        let mut component = vec![seed];
        let mut consistent = true;
        let mut next = 0;
        while next < component.len() {
            let here = component[next];
            let turned = flipped[here] == Some(true);
            for &(other, agree) in &across[here] {
                let wanted = turned == agree;
                match flipped[other as usize] {
                    None => {
                        flipped[other as usize] = Some(wanted);
                        component.push(other as usize);
                    }
                    Some(is) => consistent &= is == wanted,
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
            orientable[triangle] = consistent;
            if flipped[triangle] == Some(turned <= 0.0) {
                mesh.triangles[triangle].corners.swap(1, 2);
            }
        }
    }
    orientable
}

/// What triangles that are joined make up.
struct Components {
    /// The closed ones: every edge joined or the rim of a crack, cracks small, orientation consistent.
    closed: Vec<Vec<u32>>,
    /// Edges with a face that is not joined and no rims of cracks, of the component of the largest extents.
    open_edges: Vec<[u32; 2]>,
}

fn components(
    mesh: &Mesh,
    edges: &[SharedEdge],
    cracks: &[Facing],
    joints: &[Vec<Joint>],
    orientable: &[bool],
    is_interface: &[bool],
) -> Components {
    let mut connected = Connected::new(mesh.triangles.len());
    for joint in joints.iter().flatten() {
        connected.join(joint.a, joint.b);
    }
    let mut open: Vec<Vec<[u32; 2]>> = vec![Vec::new(); mesh.triangles.len()];
    for (edge, joints) in edges.iter().zip(joints) {
        for &face in &edge.faces {
            let open = &mut open[connected.root(face) as usize];
            // A partner along a part of an open edge does not close the rest.
            let is_joined = edge.is_crack
                || edge.faces.len() > 1 && joints.iter().any(|joint| joint.a == face || joint.b == face);
            if !is_joined && open.last() != Some(&edge.ends) {
                open.push(edge.ends);
            }
        }
    }
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); mesh.triangles.len()];
    for triangle in (0..mesh.triangles.len() as u32).filter(|&triangle| !is_interface[triangle as usize]) {
        members[connected.root(triangle) as usize].push(triangle);
    }
    let extents = |root: usize| {
        let (low, high) = mesh.bounds_of(&members[root]);
        (high - low).length()
    };
    let roots = (0..members.len()).filter(|&root| !members[root].is_empty());
    let largest = roots.map(|root| (extents(root), root)).max_by(|a, b| a.0.total_cmp(&b.0));
    let open_edges = largest.map_or(Vec::new(), |(_, root)| open[root].clone());
    let mut cracked = vec![0.0; mesh.triangles.len()];
    for Facing { faces, crack, .. } in cracks {
        cracked[connected.root(faces[0]) as usize] += crack.area;
    }
    let area = |members: &[u32]| members.iter().map(|&face| mesh.vector_area(face).length()).sum::<f64>();
    let closed = |(root, members): &(usize, Vec<u32>)| {
        !members.is_empty()
            && open[*root].is_empty()
            && orientable[*root]
            && (cracked[*root] <= 0.0 || cracked[*root] <= LARGEST_CRACKED_SHARE * area(members))
    };
    let closed = members.into_iter().enumerate().filter(closed).map(|(_, members)| members).collect();
    Components { closed, open_edges }
}
