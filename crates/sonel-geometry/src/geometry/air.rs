//! The air of a closed room: its volume, the area exposed to it, the points in it and the surfaces outside it.

use super::Geometry;
use core::f64::consts::TAU;

use crate::cells::OUTSIDE;
use crate::layers::Redrawn;
use crate::{CellPlace, Side, Surface, SurfaceId};
use glam::DVec3;
use std::collections::BTreeMap;

/// Share of diffuse rays from one side of a wall [1] that meet nothing, from which on that side is outside. Chosen, not measured: inside a
/// room it is the solid-angle share of its holes; at 1 any other building in view makes a side an inner one.
const OUTER_SHARE: f64 = 0.75;
/// Most rays from each side of a surface: the share is known to 0.06 (one standard error).
const RAYS_OF_SIDE: usize = 64;
/// Most rays from all surfaces together, which bounds the time of loading. Chosen, not measured: scenes of more than 3000 surfaces have fewer
/// for each, at least four.
const RAYS_OF_ALL: usize = 400_000;

impl Geometry {
    /// Whether a world position [m] is in the air of the closed room: within its hull and in no solid.
    pub fn contains(&self, point: DVec3) -> bool {
        self.is_air_cell(self.cell_at(point))
    }

    /// The number of the cell that a world position [m] is in: a room, the inside of a solid, or 0 for what is outside. Between two cells is
    /// always a face.
    pub fn cell_at(&self, point: DVec3) -> u32 {
        self.cells.at(&self.mesh, point)
    }

    /// Whether a cell is air of the closed room.
    pub fn is_air_cell(&self, cell: u32) -> bool {
        self.is_closed_room() && cell != OUTSIDE && self.cells.cell(cell).is_air
    }

    /// The bounded cells of air, the largest first. In the open closed objects are none.
    pub fn air_cells(&self) -> Vec<CellPlace> {
        self.cells.listed(&self.mesh, |cell| cell.is_air)
    }

    /// The walls with thickness of a room that is drawn by them, the largest first. Their faces without air are left out; their numbers
    /// are those of no cell.
    pub fn masonry(&self) -> &[CellPlace] {
        &self.masonry
    }

    /// Area of each material that each cell is exposed to [m²], by cell and material.
    pub fn coverings(&self) -> BTreeMap<u32, BTreeMap<u32, f64>> {
        let mut areas: BTreeMap<u32, BTreeMap<u32, f64>> = BTreeMap::new();
        for (triangle, face) in self.mesh.triangles.iter().zip(0..) {
            if !self.surface(self.of_triangle[face as usize]).interface {
                for cell in self.cells.sides(face) {
                    *areas.entry(cell).or_default().entry(triangle.material).or_default() +=
                        self.mesh.vector_area(face).length();
                }
            }
        }
        areas
    }

    /// The cells in front of a wall and behind it, all along it. Borders between airs bound no cells: 0.
    pub fn cells_beside(&self, surface: SurfaceId) -> impl Iterator<Item = u32> + '_ {
        self.surface(surface).triangles.iter().flat_map(|&triangle| self.cells.sides(triangle))
    }

    /// Whether a triangle bounds a solid or the room, or in the open anything closed.
    pub(crate) fn is_of_shell(&self, triangle: u32) -> bool {
        self.index.is_of_shell(triangle)
    }

    /// What was drawn more than once and counts once, by the materials.
    pub fn redrawn(&self) -> &[Redrawn] {
        &self.redrawn
    }

    /// Surfaces beyond the bounding box of the largest cell. Where there are any, the scene is not a closed room.
    pub fn outside(&self) -> Vec<SurfaceId> {
        let hull = self.cells.inside().max_by(|a, b| a.1.volume.total_cmp(&b.1.volume));
        let Some((_, hull)) = hull else { return Vec::new() };
        let tolerance = f64::from(self.resolution());
        let (low, high) = hull.bounds;
        let is_outside = |(_, surface): &(u32, &Surface)| {
            let (from, to) = self.mesh.bounds_of(&surface.triangles);
            (low - from).max_element().max((to - high).max_element()) > tolerance
        };
        (0..).zip(&self.surfaces).filter(is_outside).map(|(index, _)| SurfaceId(index)).collect()
    }

    /// Volume of the air in the closed room [m³], without that of solids. `None` when the scene is no closed room.
    pub fn volume(&self) -> Option<f64> {
        let air = self.cells.inside().filter(|(_, cell)| cell.is_air);
        self.is_closed_room().then(|| air.map(|(_, cell)| cell.volume).sum())
    }

    /// Area exposed to the air [m²], each side for itself: walls and solids with one side, but where something stands flush against them,
    /// panels with both, borders between airs not at all.
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

    /// Counts walls once that have the sky on one side and other walls on the other: those of a room with a hole, which is no closed room.
    pub(super) fn leave_out_outer_sides(&mut self) {
        let rays = (RAYS_OF_ALL / (2 * self.surfaces.len())).clamp(4, RAYS_OF_SIDE);
        for index in 0..self.surfaces.len() {
            let id = SurfaceId(index as u32);
            let is_outer = |side: Side| self.escaping(id, side, rays) >= OUTER_SHARE;
            let has_two_sides = self.exposed[index] > 1.5 * self.surfaces[index].area;
            if has_two_sides && is_outer(Side::Front) != is_outer(Side::Back) {
                self.exposed[index] *= 0.5;
            }
        }
    }

    /// Share of diffuse rays from one side of a surface that meet nothing.
    fn escaping(&self, surface: SurfaceId, side: Side, rays: usize) -> f64 {
        let Surface { normal, ref triangles, .. } = *self.surface(surface);
        let normal = side.sign() * normal;
        let (across, along) = normal.any_orthonormal_pair();
        let meets_nothing = |ray: &usize| {
            // Additive recurrence on the powers of the root of x³ = x + 1: evenly spread in two dimensions.
            let [u, v] =
                [0.754_877_666_246_693, 0.569_840_290_998_053].map(|step| (0.5 + *ray as f64 * step).fract());
            let (radius, (sine, cosine)) = (u.sqrt(), libm::sincos(TAU * v));
            let direction = (1.0 - u).sqrt() * normal + radius * (cosine * across + sine * along);
            let corners = self.local_corners(triangles[ray % triangles.len()]);
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            let from = self.leave(((a + b + c) / 3.0).as_vec3(), surface, side);
            self.closest_hit(from, direction.as_vec3()).is_none()
        };
        (0..rays).filter(meets_nothing).count() as f64 / rays as f64
    }
}
