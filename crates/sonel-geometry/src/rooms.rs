//! Rooms drawn as closed shells side by side, as in most models of buildings: between two of them is a wall whose faces belong to one shell
//! each.
//!
//! Shells are rooms where each looks at another one across a gap of at most [`THICKEST_PARTITION`], with faces that are parallel and that sound
//! passes, and all hang together in this way. A shell that is no deeper than that behind such a face may be a slab: it is no room.

use crate::Mesh;
use crate::surfaces::PARALLEL;
use crate::topology::Connected;
use glam::DVec3;

/// Largest thickness of a partition [m] (docs/formats/scene.md). Chosen, not measured: above that of masonry; doubled, a passage of 1 to 2 m
/// between two rooms whose walls transmit is a partition.
pub const THICKEST_PARTITION: f64 = 1.0;

/// Kind of the faces of a material.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaceKind {
    /// A wall.
    Wall,
    /// A wall that sound passes.
    Partition,
    /// No wall but a border between airs: rays meet it, but it is part of no shell, takes no area from the room and has no edges.
    Interface,
}

/// A face that sound passes, seen from outside of its shell.
struct Pane {
    shell: u32,
    bounds: [DVec3; 2],
    /// Unit normal out of the shell.
    outward: DVec3,
}

/// Whether closed shells in the open, each given by its outer sides, are rooms.
pub(crate) fn are_rooms(mesh: &Mesh, shells: &[Vec<u32>], kinds: &[FaceKind]) -> bool {
    if shells.len() < 2 {
        return false;
    }
    let panes: Vec<Pane> =
        (0..).zip(shells).flat_map(|(shell, sides)| panes(mesh, shell, sides, kinds)).collect();
    let mut connected = Connected::new(shells.len());
    for (index, a) in panes.iter().enumerate() {
        for b in panes[..index].iter().filter(|b| a.faces(b)) {
            connected.join(a.shell, b.shell);
        }
    }
    let first = connected.root(0);
    (1..shells.len() as u32).all(|shell| connected.root(shell) == first)
}

/// The faces of a shell that sound passes and behind which it is deeper than a partition.
fn panes(mesh: &Mesh, shell: u32, sides: &[u32], kinds: &[FaceKind]) -> Vec<Pane> {
    let triangles: Vec<u32> = sides.iter().map(|side| side / 2).collect();
    let passes = |side: &&u32| kinds.get((**side / 2) as usize) == Some(&FaceKind::Partition);
    let pane = |&side: &u32| {
        let outward = mesh.outward(side);
        let [a, b, c] = mesh.corners(side / 2);
        let depth = |corner: DVec3| (a - corner).dot(outward);
        let corners = triangles.iter().flat_map(|&triangle| mesh.corners(triangle));
        let deepest = corners.map(depth).fold(0.0, f64::max);
        (deepest > THICKEST_PARTITION).then_some(Pane {
            shell,
            bounds: [a.min(b).min(c), a.max(b).max(c)],
            outward,
        })
    };
    sides.iter().filter(passes).filter_map(pane).collect()
}

impl Pane {
    /// Whether another one is opposite, at most the thickness of a partition away.
    fn faces(&self, other: &Self) -> bool {
        let gap = (other.bounds[0] - self.bounds[0]).dot(self.outward);
        let is_opposite = self.shell != other.shell
            && self.outward.dot(other.outward) < -PARALLEL
            && gap > 0.0
            && gap <= THICKEST_PARTITION;
        let shift = gap * self.outward;
        let overlap =
            (self.bounds[1] + shift).min(other.bounds[1]) - (self.bounds[0] + shift).max(other.bounds[0]);
        // A plane face has no extent along its normal.
        let area = |axis: usize| overlap[(axis + 1) % 3].max(0.0) * overlap[(axis + 2) % 3].max(0.0);
        is_opposite && (0..3).map(area).fold(0.0, f64::max) > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Geometry, MeshTriangle};
    use glam::dvec3;

    /// Boxes of `depth` m side by side with `gap` m between them, whose faces are all partitions.
    fn row(depth: f64, gap: f64) -> Geometry {
        let mut mesh = Mesh::default();
        for place in 0..3 {
            let first = mesh.vertices.len() as u32;
            let shell = Mesh::shoebox([depth, 5.0, 3.0], [0; 6]);
            let offset = dvec3(f64::from(place) * (depth + gap), 0.0, 0.0);
            mesh.vertices.extend(shell.vertices.iter().map(|vertex| *vertex + offset));
            mesh.triangles.extend(shell.triangles.iter().map(|triangle| MeshTriangle {
                corners: triangle.corners.map(|corner| corner + first),
                ..*triangle
            }));
        }
        Geometry::with_kinds(mesh, |_| FaceKind::Partition, &[]).unwrap()
    }

    #[test]
    fn shells_side_by_side_are_rooms() {
        let rooms = row(4.0, 0.3);
        assert!(rooms.is_watertight());
        assert!((rooms.volume().unwrap() - 180.0).abs() < 1e-6);
        assert!(rooms.contains(dvec3(6.0, 2.0, 1.0)) && !rooms.contains(dvec3(4.1, 2.0, 1.0)));
    }

    #[test]
    fn slabs_and_houses_apart_are_none() {
        assert!(!row(0.2, 0.3).is_closed_room(), "three slabs");
        assert!(!row(4.0, 3.0).is_closed_room(), "three houses");
    }
}
