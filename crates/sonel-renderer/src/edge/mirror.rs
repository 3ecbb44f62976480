//! Planes as mirrors: images of points, and mirror paths between two points.

use glam::DVec3;
use sonel_diffraction::Wedge;
use sonel_geometry::{Departure, Geometry, PlaneId, Side, Surface, SurfaceId};
use sonel_map::CoefficientTable;

use super::world::RoomEdge;
use crate::mirror::tree::IN_CORNER;

/// Sine of the angle within which directions are perpendicular [1].
pub(crate) const PERPENDICULAR: f64 = 1e-6;

/// Triangles of a plane that are looked from, at most: fewer would miss what a plane faces with few of them.
const LOOKED_FROM: usize = 64;

/// How far off a surface, in lifts, it is felt for.
const FELT: f64 = 16.0;

/// A plane seen from the side of its normal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaneMirror {
    pub plane: PlaneId,
    /// One of the surfaces in it.
    pub surface: SurfaceId,
    /// Unit normal towards the air.
    normal: DVec3,
    /// normal · x of its points, about the scene's centre [m].
    offset: f64,
}

impl PlaneMirror {
    /// The plane of `surface`, seen from `side`.
    #[must_use]
    pub fn new(geometry: &Geometry, surface: SurfaceId, side: Side) -> Self {
        let of = geometry.surface(surface);
        let normal = of.normal * side.sign();
        let offset = side.sign() * (of.offset - of.normal.dot(geometry.center()));
        Self { plane: of.plane, surface, normal, offset }
    }

    /// Whether `other` is this one.
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        self.plane == other.plane && self.faces_with(other)
    }

    /// Height of `point` over the plane, positive in the air before it [m].
    #[must_use]
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// Whether `other` is turned to the same side.
    #[must_use]
    pub fn faces_with(&self, other: &Self) -> bool {
        self.normal.dot(other.normal) > 0.0
    }

    /// The mirror image of `point`.
    #[must_use]
    pub fn image(&self, point: DVec3) -> DVec3 {
        point - 2.0 * self.height(point) * self.normal
    }

    /// Image of `other` in this plane.
    #[must_use]
    pub fn image_of(&self, other: &Self) -> Self {
        let normal = other.normal - 2.0 * other.normal.dot(self.normal) * self.normal;
        Self { normal, offset: normal.dot(self.image(other.normal * other.offset)), ..*other }
    }

    /// Image of `wedge`.
    #[must_use]
    pub fn image_of_wedge(&self, wedge: &Wedge) -> Wedge {
        wedge.image(self.normal, self.offset)
    }

    /// Whether it is at a right angle to `other`.
    #[must_use]
    pub fn is_across(&self, other: &Self) -> bool {
        self.normal.dot(other.normal).abs() <= PERPENDICULAR
    }

    /// Whether it is turned to the same side as `other`, which is parallel.
    #[must_use]
    pub fn is_turned_with(&self, other: &Self) -> bool {
        (self.normal - other.normal).length() <= PERPENDICULAR
    }

    /// Whether there is a surface at `foot` in the plane, a little off to the side of `aside`.
    #[must_use]
    pub fn is_felt(&self, geometry: &Geometry, foot: DVec3, aside: DVec3) -> bool {
        let off = (self.normal + aside) * (FELT * f64::from(geometry.lift()));
        let hit = geometry.closest_hit(Departure::free((foot + off).as_vec3()), -self.normal.as_vec3());
        hit.is_some_and(|hit| geometry.surface(hit.surface).plane == self.plane)
    }

    /// Whether `edge` is seen from anywhere on its surfaces: from four places of each triangle, at three of the edge; of more than
    /// [`LOOKED_FROM`] triangles evenly from as many.
    #[must_use]
    pub fn faces_edge(&self, geometry: &Geometry, edge: &RoomEdge) -> bool {
        let (mesh, center) = (geometry.mesh(), geometry.center());
        let off = FELT * f64::from(geometry.lift());
        let places = [0.1, 0.5, 0.9].map(|share| {
            let wedge = &edge.wedge;
            wedge.at(share * wedge.length()) + wedge.into_air() * off
        });
        let sees = |from: DVec3| {
            let departure = Departure::free((from + self.normal * off).as_vec3());
            // The rims of a sheet are in its plane.
            let is_before = |to: DVec3| self.height(to) > -0.5 * off;
            places.iter().any(|&to| is_before(to) && !geometry.is_blocked(departure, to.as_vec3()))
        };
        let from_triangle = |triangle: &u32| {
            let corners = mesh.triangles[*triangle as usize].corners;
            let corners = corners.map(|corner| mesh.vertices[corner as usize] - center);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            sees(middle) || corners.into_iter().any(|corner| sees(middle.lerp(corner, 0.9)))
        };
        let own = || geometry.surfaces().iter().filter(|surface| surface.plane == self.plane);
        let count: usize = own().map(|surface| surface.triangles.len()).sum();
        let step = count.div_ceil(LOOKED_FROM).max(1);
        own().flat_map(|surface| &surface.triangles).step_by(step).any(from_triangle)
    }

    /// Whether anything of `other` is before it.
    fn sees(&self, geometry: &Geometry, other: &Self) -> bool {
        let (mesh, center) = (geometry.mesh(), geometry.center());
        let within = f64::from(geometry.lift());
        let is_before = |corner: &u32| self.height(mesh.vertices[*corner as usize] - center) > within;
        let in_other = geometry.surfaces().iter().filter(|surface| surface.plane == other.plane);
        in_other
            .flat_map(|surface| &surface.triangles)
            .any(|&triangle| mesh.triangles[triangle as usize].corners.iter().any(is_before))
    }

    /// The plane with the surface in it that `foot` lies on, or the nearest one: its surfaces may be of several materials.
    #[must_use]
    pub fn at(&self, geometry: &Geometry, foot: DVec3) -> Self {
        let material = geometry.surface(self.surface).material;
        let own =
            || geometry.surfaces().iter().enumerate().filter(|(_, surface)| surface.plane == self.plane);
        if own().all(|(_, surface)| surface.material == material) {
            return *self;
        }
        let (mesh, center) = (geometry.mesh(), geometry.center());
        let distance = |triangle: &u32| {
            let corners = mesh.triangles[*triangle as usize].corners;
            distance(foot, corners.map(|corner| mesh.vertices[corner as usize] - center))
        };
        let away = |surface: &Surface| surface.triangles.iter().map(distance).fold(f64::INFINITY, f64::min);
        let nearest = own().map(|(index, surface)| (index, away(surface))).min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.map_or(*self, |(index, _)| Self { surface: SurfaceId(index as u32), ..*self })
    }

    /// Unit normal towards the air.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.normal
    }
}

/// Distance of a point in the plane of a triangle from that [m].
fn distance(point: DVec3, corners: [DVec3; 3]) -> f64 {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let sides = [0, 1, 2].map(|side| [corners[side], corners[(side + 1) % 3]]);
    if sides.iter().all(|[from, to]| (to - from).cross(point - from).dot(normal) >= 0.0) {
        return 0.0;
    }
    sides.into_iter().map(|side| distance_to_line(point, side)).fold(f64::INFINITY, f64::min)
}

/// Distance of a point from the line between two others [m].
#[must_use]
pub(super) fn distance_to_line(point: DVec3, [from, to]: [DVec3; 2]) -> f64 {
    let along = to - from;
    let share = ((point - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    point.distance(from + along * share)
}

/// Where the straight way from `from` over `mirrors` to `to` is mirrored [m]; [`None`] where it does not meet all of their planes.
#[must_use]
pub(crate) fn feet(mirrors: &[PlaneMirror], from: DVec3, to: DVec3) -> Option<Vec<DVec3>> {
    let mut at = from;
    let foot = |(met, mirror): (usize, &PlaneMirror)| {
        let image = mirrors[met..].iter().rev().fold(to, |point, mirror| mirror.image(point));
        let (above, below) = (mirror.height(at), -mirror.height(image));
        at += (image - at) * (above / (above + below));
        (above > 0.0 && below > 0.0).then_some(at)
    };
    mirrors.iter().enumerate().map(foot).collect()
}

/// Whether the path from `from` over `mirrors`, one after the other, to `to` is clear.
#[must_use]
pub(crate) fn reflects(geometry: &Geometry, mirrors: &[PlaneMirror], from: DVec3, to: DVec3) -> bool {
    let Some(feet) = feet(mirrors, from, to) else { return false };
    let corner = IN_CORNER * f64::from(geometry.lift());
    let (mut at, mut departure) = (from, Departure::free(from.as_vec3()));
    let mut is_in_corner = false;
    for (met, (mirror, &foot)) in mirrors.iter().zip(&feet).enumerate() {
        let next = feet.get(met + 1).filter(|next| next.distance(foot) <= corner);
        if is_in_corner {
            departure = Departure::free((foot + mirror.normal * f64::from(geometry.lift())).as_vec3());
        } else {
            let direction = (foot - at).normalize().as_vec3();
            let Some(hit) = geometry.closest_hit(departure, direction) else { return false };
            let plane = geometry.surface(hit.surface).plane;
            if plane != mirror.plane && (next.is_none() || plane != mirrors[met + 1].plane) {
                return false;
            }
            departure = geometry.leave(hit.position, hit.surface, hit.side);
        }
        is_in_corner = next.is_some();
        at = foot;
    }
    !geometry.is_blocked(departure, to.as_vec3())
}

/// All planes that mirror anything in any band, from every side that faces air, each once.
#[must_use]
pub(crate) fn planes(geometry: &Geometry, table: &CoefficientTable) -> Vec<PlaneMirror> {
    let mut planes: Vec<PlaneMirror> = Vec::new();
    for (index, surface) in geometry.surfaces().iter().enumerate() {
        let specular = &table.material(surface.material).specular.energy;
        if specular.iter().flatten().all(|&factor| factor <= 0.0) {
            continue;
        }
        let sides = if surface.closed { &[Side::Front][..] } else { &[Side::Front, Side::Back] };
        for &side in sides {
            let mirror = PlaneMirror::new(geometry, SurfaceId(index as u32), side);
            if !planes.iter().any(|other| other.is(&mirror)) {
                planes.push(mirror);
            }
        }
    }
    planes
}

/// All pairs of `planes` by way of which sound may go, one after the other; of two at a right angle only one order, which stands for both.
#[must_use]
pub(crate) fn chains(geometry: &Geometry, planes: &[PlaneMirror]) -> Vec<[PlaneMirror; 2]> {
    let mut chains = Vec::new();
    for (index, one) in planes.iter().enumerate() {
        for (other_index, other) in planes.iter().enumerate() {
            let is_known = other_index < index && one.is_across(other);
            if !is_known && one.sees(geometry, other) && other.sees(geometry, one) {
                chains.push([*one, *other]);
            }
        }
    }
    chains
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;
    use sonel_geometry::{Mesh, MeshTriangle};

    #[test]
    fn a_plane_of_two_materials_is_of_the_nearer_one() {
        let vertices = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0], [5.0, 0.0], [5.0, 1.0]];
        let vertices = vertices.map(|[x, y]| dvec3(x, y, 0.0)).to_vec();
        let triangles = [([0, 1, 2], 0), ([0, 2, 3], 0), ([1, 4, 5], 1), ([1, 5, 2], 1)];
        let triangles = triangles.map(|(corners, material)| MeshTriangle { corners, material }).to_vec();
        let geometry = Geometry::build(Mesh { vertices, triangles }).unwrap();
        for surface in [0, 1].map(SurfaceId) {
            let mirror = PlaneMirror::new(&geometry, surface, Side::Front);
            for (x, y, material) in
                [(1.9, 0.5, 0), (2.1, 0.5, 1), (-3.0, 7.0, 0), (5.5, -2.0, 1), (2.4, 3.0, 1)]
            {
                let found = mirror.at(&geometry, dvec3(x, y, 0.0) - geometry.center());
                assert_eq!(geometry.surface(found.surface).material, material, "{x} {y}");
                assert!(found.is(&mirror));
            }
        }
    }
}
