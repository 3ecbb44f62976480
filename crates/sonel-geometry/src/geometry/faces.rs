//! Which faces are closed, hidden and exposed, as the cells on their two sides tell.

use crate::cells::Cells;
use crate::{Mesh, PlaneId, Surface, SurfaceId};
use foldhash::{HashMap, HashSet};

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

    /// For each face of a closed room whether only its front can face the air. A face that coincides with another one is part of a panel
    /// or lies on one, and continues in it.
    pub fn closed(&self) -> Vec<bool> {
        let is_closed = |face: u32| {
            let [front, back] = self.cells.sides(face);
            let is_wall = front != back && self.cells.is_air(face) != [true; 2];
            self.cells.is_room && !self.is_interface[face as usize] && is_wall
        };
        let mut closed: Vec<bool> = (0..self.count()).map(is_closed).collect();
        for face in self.twins.iter().flatten() {
            closed[*face as usize] &= self.cells.is_air(*face) == [false; 2];
        }
        closed
    }

    /// For each face whether it bounds a solid or the room; in the open, anything closed.
    pub fn in_shell(&self) -> Vec<bool> {
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

    /// Faces of solids that stand flush against a panel: only the panel is seen, from its other side. Of the two it has the material with the
    /// larger area in their plane, since it continues beside the solid.
    pub fn hidden(&self, surfaces: &[Surface], of_triangle: &[SurfaceId]) -> HashSet<u32> {
        let mut areas: HashMap<(PlaneId, u32), f64> = HashMap::default();
        for surface in surfaces {
            *areas.entry((surface.plane, surface.material)).or_default() += surface.area;
        }
        let area = |face: u32| {
            let Surface { plane, material, .. } = surfaces[of_triangle[face as usize].0 as usize];
            areas[&(plane, material)]
        };
        let has_one_side = |pair: &&[u32; 2]| {
            let [front, back] = self.cells.is_air(pair[0]);
            front != back
        };
        let smaller = |&[a, b]: &[u32; 2]| if area(a) < area(b) { a } else { b };
        self.twins.iter().filter(has_one_side).map(smaller).collect()
    }

    /// Area of each surface exposed to the air [m²].
    pub fn exposed(
        &self,
        mesh: &Mesh,
        surfaces: usize,
        of_triangle: &[SurfaceId],
        hidden: &HashSet<u32>,
    ) -> Vec<f64> {
        let mut sides: Vec<[bool; 2]> = (0..self.count()).map(|face| self.cells.is_air(face)).collect();
        // A panel of two faces shows the front of each.
        for &face in self.twins.iter().flatten() {
            if sides[face as usize] == [true; 2] {
                sides[face as usize] = [true, false];
            }
        }
        let mut exposed = vec![0.0; surfaces];
        for face in
            (0..self.count()).filter(|face| !self.is_interface[*face as usize] && !hidden.contains(face))
        {
            let count = sides[face as usize].iter().filter(|side| **side).count();
            exposed[of_triangle[face as usize].0 as usize] += count as f64 * mesh.vector_area(face).length();
        }
        exposed
    }
}
