//! Closed bodies of a drawing, before its faces are divided: what they share and what is between them tells walls from rooms.
//!
//! A body is a set of triangles that continue one another across edges and leave none open. Where an even number of faces
//! meet at an edge, those continue one another that were drawn one after the other; of an odd number those in one plane.

use crate::Mesh;
use crate::enclosure::{signed_volume, winding_number};
use crate::joints::{Joint, joints, unify};
use crate::topology::{Connected, SharedEdge, leave_out, shared_edges};
use foldhash::HashSet;
use glam::DVec3;
use std::cell::OnceCell;

/// The closed bodies of a mesh, which are looked for when they are first asked for: most rooms need none.
pub(crate) struct Bodies {
    drawn: Mesh,
    is_left_out: Vec<bool>,
    tolerance: f64,
    found: OnceCell<(Mesh, Vec<Body>)>,
}

struct Body {
    /// The fronts of its triangles.
    sides: Vec<u32>,
    bounds: (DVec3, DVec3),
    /// Whether all its faces were drawn with their fronts inward.
    is_inward: bool,
}

impl Bodies {
    /// Those of a welded mesh; faces that are left out are of none. Positions within `tolerance` [m] are the same.
    pub(crate) fn of(drawn: Mesh, is_left_out: Vec<bool>, tolerance: f64) -> Self {
        Self { drawn, is_left_out, tolerance, found: OnceCell::new() }
    }

    /// The bodies, and the mesh with each of them oriented.
    fn find(&self) -> (Mesh, Vec<Body>) {
        let (drawn, is_left_out) = (&self.drawn, &self.is_left_out);
        let mut mesh = drawn.clone();
        let mut edges = shared_edges(&mesh);
        leave_out(&mut edges, is_left_out);
        let is_second = vec![false; mesh.triangles.len()];
        let continued = |edge: &SharedEdge| match edge.faces.as_chunks() {
            (pairs, []) => pairs.iter().map(|&pair| Joint::new(&mesh, edge, pair)).collect(),
            _ => joints(&mesh, edge, &is_second, self.tolerance),
        };
        let joints: Vec<Vec<Joint>> = edges.iter().map(continued).collect();
        let mut connected = Connected::new(mesh.triangles.len());
        let mut open: HashSet<u32> = HashSet::default();
        for (edge, joints) in edges.iter().zip(&joints) {
            joints.iter().for_each(|joint| connected.join(joint.a, joint.b));
            let is_joined = |face: &u32| joints.iter().any(|joint| joint.a == *face || joint.b == *face);
            open.extend(edge.faces.iter().filter(|face| !is_joined(face)));
        }
        let open: HashSet<u32> = open.into_iter().map(|face| connected.root(face)).collect();
        unify(&mut mesh, &joints);
        let taken = (0..mesh.triangles.len() as u32).filter(|face| !is_left_out[*face as usize]);
        let closed = connected.groups(taken).into_iter().filter(|faces| !open.contains(&faces[0]));
        let bodies = closed.map(|faces| {
            let sides: Vec<u32> = faces.iter().map(|face| 2 * face).collect();
            let is_as_drawn = |face: &u32| mesh.triangles[*face as usize] == drawn.triangles[*face as usize];
            let is_inward = faces.iter().all(is_as_drawn) && signed_volume(&mesh, &sides) < 0.0;
            Body { sides, bounds: mesh.bounds_of(&faces), is_inward }
        });
        let bodies = bodies.collect();
        (mesh, bodies)
    }

    /// Number of the bodies around a place [m]: of all, and of those that face outward less those that face inward.
    pub(crate) fn depths(&self, place: DVec3) -> [i32; 2] {
        let (mesh, bodies) = self.found.get_or_init(|| self.find());
        let is_around = |body: &&Body| {
            let (low, high) = body.bounds;
            place.cmpge(low).all()
                && place.cmple(high).all()
                && winding_number(mesh, &body.sides, place).abs() > 0.5
        };
        bodies
            .iter()
            .filter(is_around)
            .fold([0; 2], |[all, outward], body| [all + 1, outward + if body.is_inward { -1 } else { 1 }])
    }
}
