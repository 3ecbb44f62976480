//! Regions: which places are in one air, where some surfaces bound it and sound passes others.

use super::Geometry;
use crate::Surface;
use crate::cells::{Cells, Drawing};
use crate::cracks::find_cracks;
use crate::topology::{leave_out, shared_edges};
use glam::DVec3;

/// The regions into which some surfaces of a mesh divide space. What a crack would join stays apart.
pub struct Regions<'a> {
    geometry: &'a Geometry,
    cells: Cells,
}

impl Geometry {
    /// The regions that all surfaces but those that are `passed` bound.
    pub fn regions(&self, passed: impl Fn(&Surface) -> bool) -> Regions<'_> {
        let is_passed: Vec<bool> = self.surfaces.iter().map(passed).collect();
        let is_left_out: Vec<bool> =
            self.of_triangle.iter().map(|surface| is_passed[surface.0 as usize]).collect();
        let mut edges = shared_edges(&self.mesh);
        leave_out(&mut edges, &is_left_out);
        let tolerance = f64::from(self.resolution());
        let cracks = find_cracks(&self.mesh, &mut edges, tolerance);
        let drawing = Drawing {
            edges: &edges,
            cracks: &cracks,
            is_left_out: &is_left_out,
            twins: &self.twins,
            tolerance,
            ..Drawing::default()
        };
        Regions { geometry: self, cells: Cells::find(&self.mesh, &drawing) }
    }
}

impl Regions<'_> {
    /// The number of the region that a world position [m] is in; 0 for that without bounds.
    pub fn at(&self, place: DVec3) -> u32 {
        self.cells.at(&self.geometry.mesh, place)
    }

    /// The numbers of the regions in front of a triangle and behind it.
    pub fn beside(&self, triangle: u32) -> [u32; 2] {
        self.cells.sides(triangle)
    }
}
