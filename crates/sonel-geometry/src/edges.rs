//! Straight edges of the surfaces, with the angle of the air about them: where sound may diffract.
//!
//! Edges of the mesh within one surface are none, nor are rims of cracks. The others are joined as long as they are straight and lie between
//! the same planes on the same side, so that a finely tessellated wall, or one of many materials, has one edge on each
//! side.

use crate::cells::Cells;
use crate::sectors::{AirSector, diffracting};
use crate::topology::{Connected, SharedEdge};
use crate::{Mesh, PlaneId, Surface, SurfaceId};
use foldhash::HashMap;
use glam::DVec3;
use smallvec::SmallVec;
use std::f64::consts::{PI, TAU};

/// Kind of an edge, seen from the front side of its surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EdgeShape {
    /// The rim of one surface, with air all around.
    Free,
    /// Two surfaces that protrude into the air on their front: its angle exceeds π.
    Convex,
    /// Two surfaces that form a corner: the angle of the air on their front is below π.
    Concave,
    /// Two surfaces that continue one another in one plane, as at a change of material.
    Seam,
    /// More than two surfaces, as at the foot of a screen on a floor, or two that face opposite ways.
    Junction,
}

/// A maximal straight edge between the same surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// Ends in world coordinates [m].
    pub ends: [DVec3; 2],
    /// Kind.
    pub shape: EdgeShape,
    /// The surfaces that meet here, in ascending order.
    pub surfaces: Vec<SurfaceId>,
    /// Angle of the air on the front of the surfaces [rad]: 2π at a free edge, π at a seam. Behind surfaces that are
    /// no part of a closed shell there is air too, with an angle of 2π less this one. 0 at junctions, where it is
    /// not defined.
    pub wedge_angle: f64,
    /// The sectors of air into which it diffracts: those above π, in front of its surfaces and behind.
    pub sectors: Vec<AirSector>,
}

impl Edge {
    /// Length [m].
    pub fn length(&self) -> f64 {
        self.ends[0].distance(self.ends[1])
    }
}

/// A mesh edge on the rim of its surfaces.
struct Segment {
    ends: [u32; 2],
    surfaces: SmallVec<[SurfaceId; 2]>,
    /// Plane of each face and the direction into it, in a fixed order.
    faces: SmallVec<[(PlaneId, DVec3); 2]>,
    shape: EdgeShape,
    wedge_angle: f64,
    sectors: Vec<AirSector>,
}

/// Input of the search for edges.
pub(crate) struct Survey<'a> {
    pub mesh: &'a Mesh,
    pub shared: &'a [SharedEdge],
    pub surfaces: &'a [Surface],
    pub of_triangle: &'a [SurfaceId],
    /// Distance [m] within which points are on one line.
    pub tolerance: f64,
    /// Cells, which tell the sides that face air.
    pub cells: &'a Cells,
    /// Whether each face coincides with an earlier one.
    pub is_second: &'a [bool],
}

impl Survey<'_> {
    /// Finds all edges.
    pub(crate) fn edges(&self) -> Vec<Edge> {
        let mut segments: Vec<Segment> = self.shared.iter().filter_map(|edge| self.segment(edge)).collect();
        segments.sort_by_cached_key(|segment| segment.surfaces.clone());
        let groups = straight_groups(self.mesh, &segments, self.tolerance);
        groups.into_iter().map(|group| whole(self.mesh, &segments, &group)).collect()
    }

    fn surface(&self, face: u32) -> &Surface {
        &self.surfaces[self.of_triangle[face as usize].0 as usize]
    }

    /// A mesh edge as part of an edge, unless it is within one surface or the rim of a crack.
    fn segment(&self, edge: &SharedEdge) -> Option<Segment> {
        let of = |face: u32| self.of_triangle[face as usize];
        let faces: SmallVec<[u32; 2]> =
            edge.faces.iter().copied().filter(|&face| !self.is_second[face as usize]).collect();
        let (shape, wedge_angle) = match faces[..] {
            [] => return None,
            [_] if edge.is_crack => return None,
            [_] => (EdgeShape::Free, TAU),
            [a, b] if of(a) == of(b) => return None,
            [a, b] if edge.is_ahead(self.mesh, a) != edge.is_ahead(self.mesh, b) => self.wedge(edge, [a, b]),
            _ => (EdgeShape::Junction, 0.0),
        };
        let mut surfaces: SmallVec<[SurfaceId; 2]> = faces.iter().map(|&face| of(face)).collect();
        surfaces.sort_unstable();
        surfaces.dedup();
        let sectors = match shape {
            EdgeShape::Seam => Vec::new(),
            _ => diffracting(self.mesh, edge, &faces, self.surfaces, self.cells, of),
        };
        let mut faces: SmallVec<[(PlaneId, SurfaceId, DVec3); 2]> = faces
            .iter()
            .map(|&face| (self.surface(face).plane, of(face), edge.inward(self.mesh, face)))
            .collect();
        // Two faces of one surface lie on two sides of the edge.
        let across = |inward: DVec3| inward.dot(DVec3::new(0.571, 0.337, 0.748));
        faces.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(across(a.2).total_cmp(&across(b.2))));
        let faces = faces.into_iter().map(|(plane, _, inward)| (plane, inward)).collect();
        Some(Segment { ends: edge.ends, surfaces, faces, shape, wedge_angle, sectors })
    }

    /// Shape and angle on the front of two faces that agree in orientation.
    fn wedge(&self, edge: &SharedEdge, [a, b]: [u32; 2]) -> (EdgeShape, f64) {
        if self.surface(a).plane == self.surface(b).plane {
            return (EdgeShape::Seam, PI);
        }
        let (here, there) = (edge.inward(self.mesh, a), edge.inward(self.mesh, b));
        // From the first face to the second through the air in front of the first.
        let angle = libm::atan2(self.surface(a).normal.dot(there), here.dot(there)).rem_euclid(TAU);
        (if angle > PI { EdgeShape::Convex } else { EdgeShape::Concave }, angle)
    }
}

/// Groups of segments that continue one another: the same planes and shape, a common vertex, one line.
fn straight_groups(mesh: &Mesh, segments: &[Segment], tolerance: f64) -> Vec<Vec<u32>> {
    let mut connected = Connected::new(segments.len());
    let mut at_vertex: HashMap<u32, SmallVec<[u32; 6]>> = HashMap::default();
    for (index, segment) in segments.iter().enumerate() {
        for end in segment.ends {
            let others = at_vertex.entry(end).or_default();
            for &other in others.iter() {
                if continues(mesh, &segments[other as usize], segment, end, tolerance) {
                    connected.join(other, index as u32);
                }
            }
            others.push(index as u32);
        }
    }
    connected.groups(0..segments.len() as u32)
}

fn continues(mesh: &Mesh, a: &Segment, b: &Segment, end: u32, tolerance: f64) -> bool {
    let away = |segment: &Segment| {
        let other = if segment.ends[0] == end { segment.ends[1] } else { segment.ends[0] };
        mesh.vertices[other as usize] - mesh.vertices[end as usize]
    };
    let (u, v) = (away(a), away(b));
    // Height of the shorter segment's end over the line of the longer one.
    let aside = u.cross(v).length() / u.length().max(v.length());
    let alike = a.faces.len() == b.faces.len()
        && a.faces.iter().zip(&b.faces).all(|(a, b)| a.0 == b.0 && a.1.dot(b.1) > 0.0)
        && a.sectors.len() == b.sectors.len();
    alike && a.shape == b.shape && u.dot(v) < 0.0 && aside <= tolerance
}

/// The edge that a straight group of segments makes.
fn whole(mesh: &Mesh, segments: &[Segment], group: &[u32]) -> Edge {
    let segments = || group.iter().map(|&index| &segments[index as usize]);
    let first = segments().next().expect("a group has segments");
    let [start, end] = first.ends.map(|end| mesh.vertices[end as usize]);
    let points = segments().flat_map(|segment| segment.ends).map(|end| mesh.vertices[end as usize]);
    let along = |point: &DVec3| (*point - start).dot(end - start);
    let ends = points.fold([start, end], |[low, high], point| {
        let low = if along(&point) < along(&low) { point } else { low };
        [low, if along(&point) > along(&high) { point } else { high }]
    });
    let mut surfaces: Vec<SurfaceId> = segments().flat_map(|segment| &segment.surfaces).copied().collect();
    surfaces.sort_unstable();
    surfaces.dedup();
    let Segment { shape, wedge_angle, .. } = *first;
    Edge { ends, shape, surfaces, wedge_angle, sectors: first.sectors.clone() }
}
