//! How large the faces of an edge are, and how large a path that passes it sees them.
//!
//! A face is the coplanar, connected region next to the edge, of whatever materials. Its length is the extent along the edge, its depth the
//! extent from the edge into the face. A path in the unit direction d, at an angle to the face with the unit normal n, sees the depth
//! times |d · n|: a plate seen edge-on has none.

use crate::topology::Connected;
use crate::{AirSector, EdgeShape, Geometry, SurfaceId};
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// The two faces of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeFaces([Face; 2]);

/// One of them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Face {
    /// Unit normal times the depth [m].
    across: DVec3,
    /// Length [m].
    length: f64,
}

impl EdgeFaces {
    /// Faces of four numbers each: unit normal times the depth, and the length [m]. Zeros where there is none.
    #[must_use]
    pub fn from_rows(rows: [[f64; 4]; 2]) -> Self {
        Self(rows.map(|[x, y, z, length]| Face { across: DVec3::new(x, y, z), length }))
    }

    /// The numbers of [`Self::from_rows`].
    #[must_use]
    pub fn rows(&self) -> [[f64; 4]; 2] {
        self.0.map(|Face { across, length }| [across.x, across.y, across.z, length])
    }

    /// Of each face the smaller of depth and length, of both the larger [m].
    #[must_use]
    pub fn size(&self) -> f64 {
        self.largest(|across| across.length())
    }

    /// The same with the depths that a path in a unit `direction` sees [m].
    #[inline]
    #[must_use]
    pub fn size_seen(&self, direction: DVec3) -> f64 {
        self.largest(|across| across.dot(direction).abs())
    }

    #[inline]
    fn largest(&self, depth: impl Fn(DVec3) -> f64) -> f64 {
        let [one, other] = self.0.map(|face| face.length.min(depth(face.across)));
        one.max(other)
    }
}

/// The faces of a geometry, made ready to be measured.
pub(super) struct Regions<'a> {
    geometry: &'a Geometry,
    /// Regions of surfaces: those that continue one another in a plane have the same.
    regions: Connected,
    members: HashMap<u32, Vec<SurfaceId>>,
    /// Corners of the convex hull of each region that was asked for [m].
    hulls: HashMap<u32, Vec<DVec3>>,
}

impl<'a> Regions<'a> {
    pub fn new(geometry: &'a Geometry) -> Self {
        let mut regions = Connected::new(geometry.surfaces().len());
        for edge in geometry.edges().iter().filter(|edge| edge.shape == EdgeShape::Seam) {
            for pair in edge.surfaces.windows(2) {
                regions.join(pair[0].0, pair[1].0);
            }
        }
        let mut members: HashMap<u32, Vec<SurfaceId>> = HashMap::new();
        for surface in 0..geometry.surfaces().len() as u32 {
            members.entry(regions.root(surface)).or_default().push(SurfaceId(surface));
        }
        Self { geometry, regions, members, hulls: HashMap::new() }
    }

    /// The faces about the air of `sector`, whose edge has the given unit direction and a point at `end` [m].
    pub fn of(&mut self, sector: &AirSector, along: DVec3, end: DVec3) -> EdgeFaces {
        let [(one, _), (other, _)] = sector.faces;
        let first = self.face(one, along, end, (sector.inward, sector.normal));
        let second = if one == other {
            Face { across: DVec3::ZERO, length: 0.0 }
        } else {
            self.face(other, along, end, (sector.second_inward(), sector.second_normal()))
        };
        EdgeFaces([first, second])
    }

    fn face(
        &mut self,
        surface: SurfaceId,
        along: DVec3,
        end: DVec3,
        (inward, normal): (DVec3, DVec3),
    ) -> Face {
        let region = self.regions.root(surface.0);
        let (geometry, members) = (self.geometry, &self.members[&region]);
        let hull = self.hulls.entry(region).or_insert_with(|| hull(geometry, members));
        let largest = |direction: DVec3| {
            hull.iter().map(|corner| (*corner - end).dot(direction)).fold(f64::NEG_INFINITY, f64::max)
        };
        Face { across: largest(inward).max(0.0) * normal, length: largest(along) + largest(-along) }
    }
}

/// Corners of the convex hull of coplanar surfaces [m].
fn hull(geometry: &Geometry, surfaces: &[SurfaceId]) -> Vec<DVec3> {
    let (mesh, normal) = (geometry.mesh(), geometry.surface(surfaces[0]).normal);
    let (u, v) = normal.any_orthonormal_pair();
    let triangles = surfaces.iter().flat_map(|&surface| &geometry.surface(surface).triangles);
    let mut points: Vec<(DVec2, DVec3)> = triangles
        .flat_map(|&triangle| mesh.corners(triangle))
        .map(|corner| (DVec2::new(corner.dot(u), corner.dot(v)), corner))
        .collect();
    points.sort_by(|(a, _), (b, _)| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup_by(|a, b| a.0 == b.0);
    let mut corners = half_hull(points.iter());
    corners.extend(half_hull(points.iter().rev()));
    corners
}

/// One side of the convex hull of sorted points, by Andrew's monotone chain.
fn half_hull<'p>(points: impl Iterator<Item = &'p (DVec2, DVec3)>) -> Vec<DVec3> {
    let mut chain: Vec<(DVec2, DVec3)> = Vec::new();
    for &(flat, corner) in points {
        while let [.., before, last] = &chain[..]
            && (last.0 - before.0).perp_dot(flat - last.0) <= 0.0
        {
            chain.pop();
        }
        chain.push((flat, corner));
    }
    chain.into_iter().map(|(_, corner)| corner).collect()
}
