//! The air of a closed room: its volume, the area exposed to it, the points in it and the surfaces outside it.

use super::Geometry;
use crate::enclosure::winding_number;
use crate::nesting::Shell;
use crate::{Surface, SurfaceId};
use glam::DVec3;

impl Geometry {
    /// Whether a world position [m] is in the air of the closed room: within its hull, and in no closed object but in a
    /// cavity of it.
    pub fn contains(&self, point: DVec3) -> bool {
        self.is_closed_room() && self.nesting(&self.shells_around(point)).is_some_and(|depth| depth % 2 == 0)
    }

    /// The closed shells around a world position [m], in the order of the mesh.
    pub fn shells_around(&self, point: DVec3) -> Vec<usize> {
        let around =
            |shell: &usize| winding_number(&self.mesh, &self.shells[*shell].triangles, point).abs() > 0.5;
        (0..self.shells.len()).filter(around).collect()
    }

    /// How many others the innermost of some shells lies in; none without a shell.
    pub(crate) fn nesting(&self, shells: &[usize]) -> Option<u32> {
        shells.iter().map(|&shell| self.shells[shell].depth).max()
    }

    /// Whether a triangle is part of a closed shell.
    pub(crate) fn is_of_shell(&self, triangle: u32) -> bool {
        self.index.is_of_shell(triangle)
    }

    /// Surfaces beyond the bounding box of the largest closed shell. Where there are any, the scene is not a closed room.
    pub fn outside(&self) -> Vec<SurfaceId> {
        let volume = |shell: &&Shell| shell.volume;
        let Some(hull) = self.shells.iter().max_by(|a, b| volume(a).total_cmp(&volume(b))) else {
            return Vec::new();
        };
        let tolerance = f64::from(self.resolution());
        let (low, high) = self.mesh.bounds_of(&hull.triangles);
        let is_outside = |(_, surface): &(u32, &Surface)| {
            let (from, to) = self.mesh.bounds_of(&surface.triangles);
            (low - from).max_element().max((to - high).max_element()) > tolerance
        };
        (0..).zip(&self.surfaces).filter(is_outside).map(|(index, _)| SurfaceId(index)).collect()
    }

    /// Volume of the air in the closed room [m³]: its hull's less that of the closed objects in it, which must not
    /// overlap. `None` when the scene is no closed room.
    pub fn volume(&self) -> Option<f64> {
        let hull = self.shells[self.room?].volume;
        let objects = self.shells.iter().filter(|shell| shell.depth == 1);
        Some(hull - objects.map(|shell| shell.volume).sum::<f64>())
    }

    /// Area exposed to the air [m²]: surfaces of closed shells count once, free panels with both sides, borders between airs not at all.
    pub fn area(&self) -> f64 {
        self.surfaces.iter().map(exposed).sum()
    }

    /// Area of one material exposed to the air [m²]: closed shells count once, free panels with both sides.
    pub fn exposed_area(&self, material: u32) -> f64 {
        self.surfaces.iter().filter(|surface| surface.material == material).map(exposed).sum()
    }
}

fn exposed(surface: &Surface) -> f64 {
    match (surface.interface, surface.closed) {
        (true, _) => 0.0,
        (false, true) => surface.area,
        (false, false) => 2.0 * surface.area,
    }
}
