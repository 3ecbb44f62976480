//! Which faces are closed and exposed, as the cells on their two sides tell.

use crate::cells::Cells;
use crate::{Mesh, SurfaceId};

/// The faces of a mesh between its cells.
pub(super) struct Faces<'a> {
    pub cells: &'a Cells,
    pub is_interface: &'a [bool],
    /// Pairs of faces that coincide.
    pub twins: &'a [[u32; 2]],
}

impl Faces<'_> {
    fn count(&self) -> u32 {
        self.is_interface.len() as u32
    }

    /// For each face of a closed room whether only its front can face the air.
    pub(super) fn closed(&self) -> Vec<bool> {
        let is_closed = |face: u32| {
            let [front, back] = self.cells.sides(face);
            let is_wall = front != back && self.cells.is_air(face) != [true; 2];
            self.cells.is_room && !self.is_interface[face as usize] && is_wall
        };
        (0..self.count()).map(is_closed).collect()
    }

    /// For each face whether it bounds a solid or the room; in the open, anything closed.
    pub(super) fn in_shell(&self) -> Vec<bool> {
        let is_between = |face: u32| {
            let [front, back] = if self.cells.is_room {
                self.cells.is_air(face).map(u32::from)
            } else {
                self.cells.sides(face)
            };
            front != back && !self.is_interface[face as usize]
        };
        (0..self.count()).map(is_between).collect()
    }

    /// Area of each surface exposed to the air [m²].
    pub(super) fn exposed(&self, mesh: &Mesh, surfaces: usize, of_triangle: &[SurfaceId]) -> Vec<f64> {
        let mut sides: Vec<[bool; 2]> = (0..self.count()).map(|face| self.cells.is_air(face)).collect();
        // A panel of two faces shows the front of each.
        for &face in self.twins.iter().flatten() {
            if sides[face as usize] == [true; 2] {
                sides[face as usize] = [true, false];
            }
        }
        let mut exposed = vec![0.0; surfaces];
        for face in (0..self.count()).filter(|face| !self.is_interface[*face as usize]) {
            let count = sides[face as usize].iter().filter(|side| **side).count();
            exposed[of_triangle[face as usize].0 as usize] += count as f64 * mesh.vector_area(face).length();
        }
        exposed
    }
}
