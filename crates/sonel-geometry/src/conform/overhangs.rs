//! Narrow overhangs: what is left of a wall beyond another one that it crosses, narrower than a crack may be wide.
//!
//! Walls that are drawn a little too long cross at the corner of a room. Their ends beyond it would be strips of air and edges
//! outside; without them the walls end where they meet. A strip is part of a wall that was divided, has a free rim, and is no
//! more than [`LARGEST_SHARE`] of that wall.

use crate::Mesh;
use crate::cracks::widest_crack;
use crate::topology::shared_edges;
use foldhash::HashMap;

/// Share of the area of a drawn triangle up to which a part of it is an overhang.
const LARGEST_SHARE: f64 = 0.05;
/// A strip between two lines has two triangles where nothing meets it, so that few rounds suffice.
const ROUNDS: usize = 16;

/// Leaves out overhangs; `drawn` is the place of each triangle's whole among those drawn.
pub(super) fn cut_off(mesh: &mut Mesh, drawn: &mut Vec<u32>) {
    let widest = widest_crack(mesh);
    let mut wholes: HashMap<u32, f64> = HashMap::default();
    for (face, whole) in (0..).zip(drawn.iter()) {
        *wholes.entry(*whole).or_default() += mesh.vector_area(face).length();
    }
    for _ in 0..ROUNDS {
        let mut is_free = vec![false; mesh.triangles.len()];
        for edge in shared_edges(mesh).iter().filter(|edge| edge.faces.len() == 1) {
            is_free[edge.faces[0] as usize] = true;
        }
        let is_overhang = |face: usize| {
            let [a, b, c] = mesh.corners(face as u32);
            let area = mesh.vector_area(face as u32).length();
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            is_free[face] && 2.0 * area <= widest * longest && area <= LARGEST_SHARE * wholes[&drawn[face]]
        };
        let is_out: Vec<bool> = (0..mesh.triangles.len()).map(is_overhang).collect();
        if !is_out.contains(&true) {
            return;
        }
        let mut left = is_out.iter();
        mesh.triangles.retain(|_| left.next() == Some(&false));
        let mut left = is_out.iter();
        drawn.retain(|_| left.next() == Some(&false));
    }
}
