//! Narrow overhangs: what is left of a wall beyond another one that it crosses, narrower than a crack may be wide.
//!
//! Walls that are drawn a little too long cross at the corner of a room. Their ends beyond it would be strips of air and edges
//! outside; without them the walls end where they meet. A strip is part of a wall that was divided, no more than
//! [`LARGEST_SHARE`] of it, and ends at free rims and at walls that go on without it: so no rim is left where it was.

use crate::Mesh;
use crate::cracks::widest_crack;
use crate::topology::{Connected, shared_edges};
use foldhash::HashMap;

/// Share of the area of a drawn triangle up to which a part of it is an overhang.
const LARGEST_SHARE: f64 = 0.05;

/// Leaves out overhangs; `drawn` is the place of each triangle's whole among those drawn.
pub(super) fn cut_off(mesh: &mut Mesh, drawn: &mut Vec<u32>) {
    let is_narrow = narrow_parts(mesh, drawn);
    if !is_narrow.contains(&true) {
        return;
    }
    let edges = shared_edges(mesh);
    let mut strips = Connected::new(mesh.triangles.len());
    for edge in &edges {
        if let [a, b] = edge.faces[..]
            && is_narrow[a as usize]
            && is_narrow[b as usize]
        {
            strips.join(a, b);
        }
    }
    let mut is_free = vec![false; mesh.triangles.len()];
    let mut is_part_of_wall = vec![false; mesh.triangles.len()];
    for edge in &edges {
        match edge.faces[..] {
            [face] => is_free[strips.root(face) as usize] = true,
            [a, b] if strips.root(a) != strips.root(b) => {
                [a, b].into_iter().for_each(|face| is_part_of_wall[strips.root(face) as usize] = true);
            }
            _ => {}
        }
    }
    let is_out: Vec<bool> = (0..mesh.triangles.len())
        .map(|face| {
            let strip = strips.root(face as u32) as usize;
            is_narrow[face] && is_free[strip] && !is_part_of_wall[strip]
        })
        .collect();
    let mut left = is_out.iter();
    mesh.triangles.retain(|_| left.next() == Some(&false));
    let mut left = is_out.iter();
    drawn.retain(|_| left.next() == Some(&false));
}

/// Whether each triangle is narrower than a crack may be, and a small part of what was drawn.
fn narrow_parts(mesh: &Mesh, drawn: &[u32]) -> Vec<bool> {
    let widest = widest_crack(mesh);
    let area = |face: u32| mesh.vector_area(face).length();
    let mut wholes: HashMap<u32, f64> = HashMap::default();
    for (face, whole) in (0..).zip(drawn) {
        *wholes.entry(*whole).or_default() += area(face);
    }
    let is_narrow = |(face, whole): (u32, &u32)| {
        let [a, b, c] = mesh.corners(face);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        2.0 * area(face) <= widest * longest && area(face) <= LARGEST_SHARE * wholes[whole]
    };
    (0..).zip(drawn).map(is_narrow).collect()
}
