//! Overlapping parallel faces: a face drawn twice, or one on another, such as a carpet on a floor.
//!
//! Two faces overlap where they are parallel, no farther apart than a given gap, and share more than a thousandth of the smaller
//! one's area, projected along their normal. Faces of closed shells with opposite normals do not count: there an object touches a
//! wall, the ground or another object, or a panel has two sides.
//!
//! Reference: [Sutherland1974] (docs/references.md).

use crate::mesh::sides;
use crate::surfaces::PARALLEL;
use crate::{Geometry, SurfaceId};
use glam::DVec3;
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// Largest share of the smaller triangle [1] that an overlap from rounded corners has. Chosen, not measured; doubled, strips of up to 0.2 %
/// are not reported.
const LEAST_SHARE: f64 = 1e-3;

/// Two surfaces that overlap; both are one where a part of a surface was drawn twice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// The surfaces, the lower first.
    pub surfaces: [SurfaceId; 2],
    /// Area in which they overlap [m²].
    pub area: f64,
    /// Centroid of that area, in world coordinates [m].
    pub center: DVec3,
}

/// Corners of a clipped triangle.
type Polygon = SmallVec<[DVec3; 8]>;

impl Geometry {
    /// All surfaces that overlap within `gap` [m], the largest area first.
    pub fn overlaps(&self, gap: f64) -> Vec<Overlap> {
        let mut found: BTreeMap<[SurfaceId; 2], (f64, DVec3)> = BTreeMap::new();
        for first in 0..self.mesh().triangles.len() as u32 {
            self.visit_near(first, gap as f32, |second| {
                if first < second
                    && self.may_overlap(first, second, gap)
                    && let Some((area, center)) = self.shared_area(first, second)
                {
                    let mut surfaces = [first, second].map(|triangle| self.triangle_surface(triangle));
                    surfaces.sort_unstable();
                    let sum = found.entry(surfaces).or_default();
                    *sum = (sum.0 + area, sum.1 + area * center);
                }
            });
        }
        let whole =
            |(surfaces, (area, moment)): (_, (f64, DVec3))| Overlap { surfaces, area, center: moment / area };
        let mut overlaps: Vec<Overlap> = found.into_iter().map(whole).collect();
        overlaps.sort_by(|a, b| b.area.total_cmp(&a.area));
        overlaps
    }

    /// Whether two triangles lie in parallel planes within `gap` [m] and are not the contact of two objects.
    fn may_overlap(&self, first: u32, second: u32, gap: f64) -> bool {
        let [here, there] = [first, second].map(|triangle| self.surface(self.triangle_surface(triangle)));
        // In one plane the mesh conforms.
        if here.plane == there.plane {
            return false;
        }
        let cosine = here.normal.dot(there.normal);
        let shells = [first, second].map(|triangle| self.is_of_shell(triangle));
        let is_contact = match shells {
            [true, true] => cosine < 0.0,
            [false, false] => false,
            _ => !self.is_closed_room(),
        };
        let [a, b] = [first, second].map(|triangle| self.mesh().triangles[triangle as usize].corners);
        let coincide = a.iter().all(|corner| b.contains(corner));
        let is_near = |corner: &DVec3| (here.normal.dot(*corner) - here.offset).abs() <= gap;
        cosine.abs() > PARALLEL
            && !is_contact
            && !coincide
            && !here.interface
            && !there.interface
            && self.mesh().corners(second).iter().all(is_near)
    }

    /// Area [m²] and centroid [m] of the overlap of two parallel triangles; none where it is below [`LEAST_SHARE`].
    pub(crate) fn shared_area(&self, first: u32, second: u32) -> Option<(f64, DVec3)> {
        let normals = [first, second].map(|triangle| self.mesh().vector_area(triangle));
        let least = LEAST_SHARE * normals[0].length().min(normals[1].length());
        let corners = self.mesh().corners(first);
        let sides = sides(self.mesh().corners(second)).map(|[from, to]| (from, normals[1].cross(to - from)));
        // Height over a side, times length of the side and area.
        let height = |(from, inward): (DVec3, DVec3), point: DVec3| inward.dot(point - from);
        let is_beyond =
            |side| corners.iter().all(|&corner| height(side, corner) <= least * normals[1].length());
        if sides.into_iter().any(is_beyond) {
            return None;
        }
        let shared = sides.into_iter().fold(Polygon::from_iter(corners), |polygon, side| {
            clipped(&polygon, |point| height(side, point))
        });
        let (mut area, mut moment) = (0.0, DVec3::ZERO);
        for pair in shared.get(1..)?.windows(2) {
            let part = 0.5 * (pair[0] - shared[0]).cross(pair[1] - shared[0]).length();
            area += part;
            moment += part * (shared[0] + pair[0] + pair[1]) / 3.0;
        }
        (area > least).then(|| (area, moment / area))
    }
}

/// The part of a convex polygon where `height` is positive.
fn clipped(polygon: &[DVec3], height: impl Fn(DVec3) -> f64) -> Polygon {
    let mut part = Polygon::new();
    for (i, &here) in polygon.iter().enumerate() {
        let next = polygon[(i + 1) % polygon.len()];
        let heights = [height(here), height(next)];
        if heights[0] > 0.0 {
            part.push(here);
        }
        if (heights[0] > 0.0) != (heights[1] > 0.0) {
            part.push(here.lerp(next, heights[0] / (heights[0] - heights[1])));
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mesh, MeshTriangle};
    use glam::dvec3;

    /// A box of 10 × 7 × 3 m with more faces in it.
    fn room_with(faces: &[[DVec3; 3]]) -> Geometry {
        let mut mesh = Mesh::shoebox([10.0, 7.0, 3.0], [0; 6]);
        for face in faces {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(face);
            mesh.triangles.push(MeshTriangle { corners: [first, first + 1, first + 2], material: 1 });
        }
        Geometry::build(mesh).unwrap()
    }

    fn carpet(z: f64) -> [[DVec3; 3]; 2] {
        let at = |x, y| dvec3(x, y, z);
        [[at(2.0, 1.0), at(4.0, 1.0), at(4.0, 6.0)], [at(2.0, 1.0), at(4.0, 6.0), at(2.0, 6.0)]]
    }

    #[test]
    fn a_carpet_on_the_floor_overlaps_it_where_it_lies() {
        let [overlap] = room_with(&carpet(5e-4)).overlaps(1e-3)[..] else { panic!("one overlap") };
        assert!((overlap.area - 10.0).abs() < 1e-9, "{overlap:?}");
        assert!(overlap.center.distance(dvec3(3.0, 3.5, 0.0)) < 1e-3, "{overlap:?}");
        assert_eq!(room_with(&carpet(2e-3)).overlaps(1e-3), []);
        assert_eq!(room_with(&[]).overlaps(1e-3), []);
    }

    #[test]
    fn a_block_on_the_floor_touches_it() {
        let block = Mesh::shoebox([2.0, 2.0, 1.0], [0; 6]);
        let faces = |shift: DVec3| -> Vec<[DVec3; 3]> {
            (0..12).map(|triangle| block.corners(triangle).map(|corner| corner + shift)).collect()
        };
        let at = |x: f64| faces(dvec3(x, 2.0, 0.0));
        assert_eq!(room_with(&at(1.0)).overlaps(1e-3), []);
        assert_eq!(room_with(&[at(1.0), at(3.0)].concat()).overlaps(1e-3), []);
        // Blocks within one another have common tops, bottoms and sides, which are united.
        let overlapping = room_with(&[at(1.0), at(2.0)].concat());
        assert_eq!(overlapping.overlaps(1e-3), []);
        let top: f64 = overlapping
            .surfaces()
            .iter()
            .filter(|surface| (surface.centroid.z - 1.0).abs() < 1e-9)
            .map(|surface| surface.area)
            .sum();
        assert!((top - 6.0).abs() < 1e-9, "{top}");
    }
}
