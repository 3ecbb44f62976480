//! Closed shells of a mesh: its triangles have two sides, and sides that face one region of air or solid are joined.
//!
//! - Any number of faces may meet at an edge. In order of their angle about it, each wedge between two neighbours joins the two sides that
//!   face it; a free rim joins the two sides of its face.
//! - Faces that coincide, as where a solid stands flush against a wall, are joined in pairs: the air in front of one continues in front of
//!   the other, the solid behind one behind the other.
//! - Sheets are left out first: triangles with a free rim, then those that have one once others are left out.
//!
//! The sides of a region on one connected boundary enclose a signed volume. Where they enclose it from outside they are a shell: the hull of
//! a room with whatever stands flush in it, or an object. So are those that enclose it from inside if no triangle of theirs is in such a
//! shell: a solid that touches a hull along an edge. A triangle with both sides in one region, or between two in one hull, is a sheet.

use crate::Mesh;
use crate::cracks::Facing;
use crate::enclosure::signed_volume;
use crate::nesting::Shell;
use crate::topology::{Connected, SharedEdge};
use foldhash::HashMap;
use smallvec::SmallVec;
use std::f64::consts::TAU;

/// A shell is closed if its cracks have at most this share of its area.
const LARGEST_CRACKED_SHARE: f64 = 1e-3;

/// The closed shells in the order of their lowest triangle, their triangles turned so that the normals point out of them.
///
/// Triangles of `left_out` are in none. Two sheets back to back have no inside and keep their orientation; their shell has no volume.
pub(crate) fn closed_shells(
    mesh: &mut Mesh,
    edges: &[SharedEdge],
    cracks: &[Facing],
    left_out: &[bool],
    tolerance: f64,
) -> Vec<Shell> {
    let is_sheet = sheets(edges, left_out);
    let mut sides = Sides { mesh, connected: Connected::new(2 * left_out.len()) };
    edges.iter().for_each(|edge| sides.join_around(edge, &is_sheet, tolerance));
    let cracked = cracks.iter().filter_map(|facing| sides.join_across(facing, edges, &is_sheet)).collect();
    let boundaries = sides.boundaries(&is_sheet, cracked);
    let enclosing: Vec<Enclosing> =
        boundaries.into_iter().filter_map(|boundary| boundary.enclosing(mesh, tolerance)).collect();
    let mut in_shell = vec![false; left_out.len()];
    let mut shells = Vec::new();
    for is_outside in [true, false] {
        for Enclosing { sides, shell, .. } in enclosing.iter().filter(|it| it.is_outside == is_outside) {
            if !is_outside && shell.triangles.iter().any(|&triangle| in_shell[triangle as usize]) {
                continue;
            }
            for (side, &triangle) in sides.iter().zip(&shell.triangles) {
                in_shell[triangle as usize] = true;
                if (side % 2 == 0) != is_outside {
                    mesh.triangles[triangle as usize].corners.swap(1, 2);
                }
            }
            shells.push(shell.clone());
        }
    }
    shells.sort_by_key(|shell: &Shell| shell.triangles[0]);
    shells
}

/// Whether each triangle is left out or part of a sheet.
fn sheets(edges: &[SharedEdge], left_out: &[bool]) -> Vec<bool> {
    let mut is_sheet = left_out.to_vec();
    let mut of_face: Vec<SmallVec<[u32; 3]>> = vec![SmallVec::new(); left_out.len()];
    let is_free = |edge: usize, faces: usize| faces == 1 && !edges[edge].is_crack;
    let mut left: Vec<usize> = edges.iter().map(|edge| edge.faces.len()).collect();
    let mut free: Vec<usize> = (0..edges.len()).filter(|&edge| is_free(edge, left[edge])).collect();
    if free.is_empty() {
        return is_sheet;
    }
    for (index, edge) in edges.iter().enumerate() {
        edge.faces.iter().for_each(|&face| of_face[face as usize].push(index as u32));
    }
    while let Some(edge) = free.pop() {
        let Some(&face) = edges[edge].faces.iter().find(|&&face| !is_sheet[face as usize]) else { continue };
        is_sheet[face as usize] = true;
        for &other in &of_face[face as usize] {
            let other = other as usize;
            left[other] -= 1;
            if is_free(other, left[other]) {
                free.push(other);
            }
        }
    }
    is_sheet
}

/// The sides of triangles: 2 t is the front of triangle t, 2 t + 1 its back.
struct Sides<'a> {
    mesh: &'a Mesh,
    connected: Connected,
}

impl Sides<'_> {
    /// Joins the sides that face one another about an edge.
    fn join_around(&mut self, edge: &SharedEdge, is_sheet: &[bool], tolerance: f64) {
        let mut faces: SmallVec<[u32; 2]> =
            edge.faces.iter().copied().filter(|&face| !is_sheet[face as usize]).collect();
        if faces.len() > 2 {
            faces = self.join_coinciding(edge, self.sorted(edge, faces), tolerance);
        }
        if !edge.is_crack {
            self.join_in_order(edge, &faces);
        }
    }

    /// Faces at an edge in the order of their angles about it.
    fn sorted(&self, edge: &SharedEdge, faces: SmallVec<[u32; 2]>) -> SmallVec<[u32; 2]> {
        let along = edge.along(self.mesh);
        let origin = edge.inward(self.mesh, faces[0]);
        let quarter = along.cross(origin);
        let turn = |face: u32| {
            let inward = edge.inward(self.mesh, face);
            libm::atan2(inward.dot(quarter), inward.dot(origin)).rem_euclid(TAU)
        };
        let mut turns: Vec<(f64, u32)> = faces.into_iter().map(|face| (turn(face), face)).collect();
        turns.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        turns.into_iter().map(|(_, face)| face).collect()
    }

    /// Joins pairs of successive faces about an edge that lie on one another; returns the others.
    fn join_coinciding(
        &mut self,
        edge: &SharedEdge,
        faces: SmallVec<[u32; 2]>,
        tolerance: f64,
    ) -> SmallVec<[u32; 2]> {
        let mut others: SmallVec<[u32; 2]> = SmallVec::new();
        for face in faces {
            match others.last() {
                Some(&last) if coincide(self.mesh, edge, [last, face], tolerance) => {
                    self.join_in_order(edge, &[last, face]);
                    others.pop();
                }
                _ => others.push(face),
            }
        }
        // Rounding may put one of a pair at the other end of the circle.
        if let [first, .., last] = others[..]
            && coincide(self.mesh, edge, [first, last], tolerance)
        {
            self.join_in_order(edge, &[first, last]);
            others.pop();
            others.remove(0);
        }
        others
    }

    /// Joins the sides in the wedges between successive faces about an edge, the last and the first too.
    fn join_in_order(&mut self, edge: &SharedEdge, faces: &[u32]) {
        for (at, &face) in faces.iter().enumerate() {
            let next = faces[(at + 1) % faces.len()];
            // The normal of a face that runs along the edge points to where angles grow.
            let ahead = 2 * face + u32::from(!edge.is_ahead(self.mesh, face));
            let behind = 2 * next + u32::from(edge.is_ahead(self.mesh, next));
            self.connected.join(ahead, behind);
        }
    }

    /// Joins the sides of two faces on either side of a crack; returns one of each and the crack's area [m²]. Next to a sheet the other face
    /// has a free rim.
    fn join_across(
        &mut self,
        facing: &Facing,
        edges: &[SharedEdge],
        is_sheet: &[bool],
    ) -> Option<(u32, f64)> {
        let [a, b] = facing.faces;
        if is_sheet[a as usize] || is_sheet[b as usize] {
            [a, b].into_iter().for_each(|face| self.connected.join(2 * face, 2 * face + 1));
            return None;
        }
        let turned = u32::from(!facing.agree(self.mesh, edges));
        self.connected.join(2 * a, 2 * b + turned);
        self.connected.join(2 * a + 1, 2 * b + 1 - turned);
        Some((a, facing.crack.area))
    }

    /// The boundaries that separate regions, in the order of their lowest triangle, given faces at cracks and the areas of these [m²].
    fn boundaries(&mut self, is_sheet: &[bool], cracked: Vec<(u32, f64)>) -> Vec<Boundary> {
        let mut known: HashMap<u32, usize> = HashMap::default();
        let mut boundaries: Vec<Boundary> = Vec::new();
        for triangle in (0..is_sheet.len() as u32).filter(|&triangle| !is_sheet[triangle as usize]) {
            let roots = [2 * triangle, 2 * triangle + 1].map(|side| self.connected.root(side));
            for side in (0..2).filter(|_| roots[0] != roots[1]) {
                let index = *known.entry(roots[side]).or_insert_with(|| {
                    boundaries.push(Boundary { sides: Vec::new(), cracked: 0.0 });
                    boundaries.len() - 1
                });
                boundaries[index].sides.push(2 * triangle + side as u32);
            }
        }
        for (face, area) in cracked {
            for side in [2 * face, 2 * face + 1] {
                if let Some(&index) = known.get(&self.connected.root(side)) {
                    boundaries[index].cracked += area;
                }
            }
        }
        boundaries
    }
}

/// Whether two faces at an edge lie on one another.
fn coincide(mesh: &Mesh, edge: &SharedEdge, pair: [u32; 2], tolerance: f64) -> bool {
    let [a, b] = pair.map(|face| edge.height(mesh, face));
    let height = a.length().min(b.length());
    a.dot(b) > 0.0 && a.normalize_or_zero().cross(b.normalize_or_zero()).length() * height <= tolerance
}

/// Sides that face one region, of triangles whose other side faces another one.
struct Boundary {
    sides: Vec<u32>,
    /// Area of the cracks in it [m²].
    cracked: f64,
}

/// A boundary that encloses a volume.
struct Enclosing {
    sides: Vec<u32>,
    /// Whether the region that they face is outside.
    is_outside: bool,
    shell: Shell,
}

impl Boundary {
    /// What it encloses, unless its cracks are too large. Two sheets back to back have no inside: what the first one faces is outside.
    fn enclosing(self, mesh: &Mesh, tolerance: f64) -> Option<Enclosing> {
        let Self { sides, cracked } = self;
        let volume = signed_volume(mesh, &sides);
        let area: f64 = sides.iter().map(|side| mesh.vector_area(side / 2).length()).sum();
        let is_flat = volume.abs() <= tolerance * area;
        let is_outside = if is_flat { sides[0] % 2 == 0 } else { volume > 0.0 };
        let triangles = sides.iter().map(|side| side / 2).collect();
        let shell = Shell { triangles, depth: 0, volume: volume.abs(), is_flat };
        let is_closed = cracked <= 0.0 || cracked <= LARGEST_CRACKED_SHARE * area;
        is_closed.then_some(Enclosing { sides, is_outside, shell })
    }
}
