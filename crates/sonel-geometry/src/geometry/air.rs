//! The air of a closed room: its volume, the area exposed to it, the points in it and the surfaces outside it.

use super::{Geometry, MOST_PARTITIONS};
use crate::enclosure::winding_number;
use crate::nesting::Shell;
use crate::{Side, Surface, SurfaceId};
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

    /// Area exposed to the air [m²]: surfaces of closed shells count once, less where they touch another one, free panels with both sides,
    /// borders between airs and panels in solids not at all.
    pub fn area(&self) -> f64 {
        self.exposed.iter().sum()
    }

    /// Area of one material exposed to the air [m²], counted as in [`Geometry::area`].
    pub fn exposed_area(&self, material: u32) -> f64 {
        let of_material = |(surface, _): &(&Surface, &f64)| surface.material == material;
        self.surfaces.iter().zip(&self.exposed).filter(of_material).map(|(_, area)| area).sum()
    }

    /// Area of one surface exposed to the air [m²], counted as in [`Geometry::area`].
    pub fn exposed(&self, surface: SurfaceId) -> f64 {
        self.exposed[surface.0 as usize]
    }

    /// Area of each surface exposed to the air [m²].
    pub(super) fn exposed_areas(&self) -> Vec<f64> {
        let mut exposed: Vec<f64> = self.surfaces.iter().map(|surface| self.uncovered(surface)).collect();
        // Which ways the closed surfaces of each plane face.
        let planes = self.surfaces.iter().map(|surface| surface.plane.0 as usize + 1).max().unwrap_or(0);
        let mut ways = vec![[false; 2]; planes];
        let is_along = |surface: &Surface| surface.normal.dot(self.index.plane(surface.plane).normal) > 0.0;
        for surface in self.surfaces.iter().filter(|surface| surface.closed) {
            ways[surface.plane.0 as usize][usize::from(is_along(surface))] = true;
        }
        let is_opposite = |one: &Surface, other: &Surface| {
            other.closed && other.plane == one.plane && is_along(other) != is_along(one)
        };
        for (index, surface) in self.surfaces.iter().enumerate() {
            if !surface.closed || !is_along(surface) || ways[surface.plane.0 as usize] != [true; 2] {
                continue;
            }
            for &triangle in &surface.triangles {
                self.visit_near(triangle, self.resolution(), |other| {
                    let SurfaceId(beside) = self.triangle_surface(other);
                    if is_opposite(surface, &self.surfaces[beside as usize])
                        && let Some((area, _)) = self.shared_area(triangle, other)
                    {
                        exposed[index] -= area;
                        exposed[beside as usize] -= area;
                    }
                });
            }
        }
        exposed.into_iter().map(|area| area.max(0.0)).collect()
    }

    /// Area of a surface on its sides in the air [m²], as if nothing touched it.
    fn uncovered(&self, surface: &Surface) -> f64 {
        let sides = match (surface.interface, surface.closed) {
            (true, _) => 0,
            (false, true) => 1,
            (false, false) if !self.is_closed_room() => 2,
            _ => [Side::Front, Side::Back].into_iter().filter(|side| self.faces_air(surface, *side)).count(),
        };
        sides as f64 * surface.area
    }

    /// Whether one side of a panel in a closed room faces the air: the shell in front of its first triangle is turned towards it.
    fn faces_air(&self, panel: &Surface, side: Side) -> bool {
        let [a, b, c] = self.mesh.corners(panel.triangles[0]);
        let middle = self.to_local((a + b + c) / 3.0);
        let direction = (side.sign() * panel.normal).as_vec3();
        let mut from = self.leave(middle, self.triangle_surface(panel.triangles[0]), side);
        for _ in 0..MOST_PARTITIONS {
            let Some(hit) = self.closest_hit(from, direction) else { return false };
            if self.is_of_shell(hit.triangle) {
                return hit.side == Side::Front;
            }
            from = self.leave(hit.position, hit.surface, hit.side.opposite());
        }
        false
    }
}
