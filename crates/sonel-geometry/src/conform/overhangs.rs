//! Narrow overhangs: what is left of a wall beyond another one that it crosses, narrower than a crack may be wide.
//!
//! Walls that are drawn a little too long cross at the corner of a room. Their ends beyond it would be strips of air and edges
//! outside; without them the walls end where they meet. A strip is a piece of a wall that others cut off from the rest, with a
//! free rim, and no more than [`LARGEST_SHARE`] of the triangles that were drawn there.

use crate::Mesh;
use crate::cracks::widest_crack;
use crate::layers::is_flat;
use crate::topology::{Connected, shared_edges};
use foldhash::{HashMap, HashSet};
use glam::DVec3;

/// Largest share of the area of the drawn triangles that an overhang has [1]. Chosen, not measured; doubled, narrow ledges that are a tenth of
/// a wall are cut off too.
const LARGEST_SHARE: f64 = 0.05;

/// Faces that continue one another in one plane.
#[derive(Clone, Copy)]
struct PlaneFaces {
    area: f64,
    /// Area of the drawn triangles that they are parts of.
    drawn_area: f64,
    low: DVec3,
    high: DVec3,
    has_free_rim: bool,
}

/// Leaves out overhangs; `drawn` is the place of each triangle's whole among those drawn.
pub(super) fn cut_off(mesh: &mut Mesh, drawn: &mut Vec<u32>) {
    let widest = widest_crack(mesh);
    let (pieces, mut of_face) = pieces(mesh, drawn);
    let is_overhang = |root: u32| {
        let PlaneFaces { area, drawn_area, low, high, has_free_rim } = pieces[&root];
        has_free_rim && area <= widest * low.distance(high) && area <= LARGEST_SHARE * drawn_area
    };
    let is_out: Vec<bool> = (0..drawn.len() as u32).map(|face| is_overhang(of_face.root(face))).collect();
    let mut left = is_out.iter();
    mesh.triangles.retain(|_| left.next() == Some(&false));
    let mut left = is_out.iter();
    drawn.retain(|_| left.next() == Some(&false));
}

/// The pieces by their first face, and the piece of each face.
fn pieces(mesh: &Mesh, drawn: &[u32]) -> (HashMap<u32, PlaneFaces>, Connected) {
    let mut of_face = Connected::new(drawn.len());
    let edges = shared_edges(mesh);
    for edge in &edges {
        if let [a, b] = edge.faces[..]
            && is_flat(mesh, edge, [a, b])
        {
            of_face.join(a, b);
        }
    }
    let area = |face: u32| mesh.vector_area(face).length();
    let mut wholes: HashMap<u32, f64> = HashMap::default();
    (0..).zip(drawn).for_each(|(face, whole)| *wholes.entry(*whole).or_default() += area(face));
    let mut pieces: HashMap<u32, PlaneFaces> = HashMap::default();
    let mut counted: HashSet<[u32; 2]> = HashSet::default();
    for (face, whole) in (0..).zip(drawn) {
        let root = of_face.root(face);
        let piece = pieces.entry(root).or_insert(PlaneFaces {
            area: 0.0,
            drawn_area: 0.0,
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            has_free_rim: false,
        });
        piece.area += area(face);
        piece.drawn_area += if counted.insert([root, *whole]) { wholes[whole] } else { 0.0 };
        let [a, b, c] = mesh.corners(face);
        piece.low = piece.low.min(a).min(b).min(c);
        piece.high = piece.high.max(a).max(b).max(c);
    }
    for edge in edges.iter().filter(|edge| edge.faces.len() == 1) {
        pieces.entry(of_face.root(edge.faces[0])).and_modify(|piece| piece.has_free_rim = true);
    }
    (pieces, of_face)
}
