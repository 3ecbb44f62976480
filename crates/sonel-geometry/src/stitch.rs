//! Closing T-junctions: where a vertex lies on the rim of a triangle that does not have it.
//!
//! Drawing programs leave them wherever one wall ends in the middle of another. Rays may slip through, and a room with
//! one is not closed. The triangle is divided at the vertex; only open edges are and those of more than two faces, as where a solid stands
//! flush against a wall, so a screen that merely stands on a floor divides nothing.

use crate::Mesh;
use crate::boundary::{OpenEdge, sides_of_faces};
use crate::grid::BoxGrid;
use crate::topology::edges_where;
use glam::DVec3;

/// Every pass divides a side of each triangle at all its vertices, so that no mesh needs as many.
const PASSES: usize = 64;

/// Divides triangles at the vertices within `tolerance` [m] of their rims that `accepts` takes for a rim, given where they lie along it
/// as a share of its length; returns how many divisions it took.
pub(crate) fn stitch_where(
    mesh: &mut Mesh,
    tolerance: f64,
    accepts: impl Fn(&OpenEdge, u32, f64) -> bool,
) -> usize {
    let mut divisions = 0;
    for _ in 0..PASSES {
        let before = divisions;
        let mut done = vec![false; mesh.triangles.len()];
        for (mut rest, vertices) in vertices_on_rims(mesh, tolerance, &accepts) {
            // One side of a triangle at a time; its parts are looked at again.
            if std::mem::replace(&mut done[rest.face as usize], true) {
                continue;
            }
            for vertex in vertices {
                let place = mesh.vertices[vertex as usize];
                let share = share_along(rest.points, place, tolerance);
                if share.is_some_and(|share| accepts(&rest, vertex, share)) {
                    divide(mesh, rest.face, rest.ends, vertex);
                    (rest.ends[0], rest.points[0]) = (vertex, place);
                    divisions += 1;
                }
            }
        }
        if divisions == before {
            break;
        }
    }
    divisions
}

/// Rims with vertices on them, in order along them.
fn vertices_on_rims(
    mesh: &Mesh,
    tolerance: f64,
    accepts: impl Fn(&OpenEdge, u32, f64) -> bool,
) -> Vec<(OpenEdge, Vec<u32>)> {
    let edges = edges_where(mesh, |faces| faces != 2);
    let rims = sides_of_faces(mesh, &edges, |_| true);
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let grid = edge_grid(&rims, tolerance);
    let open = edges.iter().filter(|edge| edge.faces.len() == 1);
    let mut candidates: Vec<u32> = open.flat_map(|edge| edge.ends).collect();
    candidates.sort_unstable();
    candidates.dedup();
    let mut found: Vec<Vec<(f64, u32)>> = vec![Vec::new(); rims.len()];
    for vertex in candidates {
        for &index in grid.around(at(vertex)) {
            let rim = &rims[index as usize];
            if let Some(share) = share_along(rim.points, at(vertex), tolerance)
                && !mesh.triangles[rim.face as usize].corners.contains(&vertex)
                && accepts(rim, vertex, share)
            {
                found[index as usize].push((share, vertex));
            }
        }
    }
    let occupied = rims.into_iter().zip(found).filter(|(_, vertices)| !vertices.is_empty());
    occupied
        .map(|(rim, mut vertices)| {
            vertices.sort_by(|a, b| a.0.total_cmp(&b.0));
            (rim, vertices.into_iter().map(|(_, vertex)| vertex).collect())
        })
        .collect()
}

/// Edges filed by the boxes around them, `margin` [m] wider on all sides.
pub(crate) fn edge_grid(edges: &[OpenEdge], margin: f64) -> BoxGrid {
    let around = |edge: &OpenEdge| {
        let [a, b] = edge.points;
        (a.min(b) - margin, a.max(b) + margin)
    };
    BoxGrid::new(&edges.iter().map(around).collect::<Vec<_>>())
}

/// Position of a point along a segment as a share of its length; [`None`] unless the point is inside the segment.
pub(crate) fn share_along([from, to]: [DVec3; 2], point: DVec3, tolerance: f64) -> Option<f64> {
    let along = to - from;
    let share = (point - from).dot(along) / along.length_squared();
    let beside = point.distance(from + share * along);
    (share > 0.0 && share < 1.0 && beside <= tolerance).then_some(share)
}

/// Divides a triangle at a vertex on one of its sides.
fn divide(mesh: &mut Mesh, face: u32, ends: [u32; 2], vertex: u32) {
    let whole = mesh.triangles[face as usize];
    let part = |replaced: u32| crate::MeshTriangle {
        corners: whole.corners.map(|corner| if corner == replaced { vertex } else { corner }),
        material: whole.material,
    };
    mesh.triangles[face as usize] = part(ends[0]);
    mesh.triangles.push(part(ends[1]));
}
