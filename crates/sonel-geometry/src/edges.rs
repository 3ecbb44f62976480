//! Straight edges of the surfaces, with the angle of the air about them: where sound may diffract.
//!
//! Edges of the mesh within one surface are none. The others are joined as long as they are straight and lie between
//! the same surfaces, so that a finely tessellated wall has one edge on each side.

use crate::topology::{Connected, SharedEdge};
use crate::{Mesh, Surface, SurfaceId};
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// What kind of edge it is, judged on the front side of its surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EdgeShape {
    /// The rim of one surface, with air all around.
    Free,
    /// The rim of one surface which ends on another without sharing vertices, as a screen's foot on the floor.
    Abutting,
    /// Two surfaces that protrude into the air on their front: its angle exceeds π.
    Convex,
    /// Two surfaces that form a corner: the angle of the air on their front is below π.
    Concave,
    /// Two surfaces that continue one another in one plane, as at a change of material.
    Seam,
    /// More than two surfaces, or two that face opposite ways.
    Junction,
}

/// A maximal straight edge between the same surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// Its two ends, in world coordinates [m].
    pub ends: [DVec3; 2],
    /// Its kind.
    pub shape: EdgeShape,
    /// The surfaces that meet here, in ascending order.
    pub surfaces: Vec<SurfaceId>,
    /// Angle of the air on the front of the surfaces [rad]: 2π at a free edge, π at a seam. Behind surfaces that are
    /// no part of a closed shell there is air too, with an angle of 2π less this one. 0 at abutting edges and
    /// junctions, where it is not defined.
    pub wedge_angle: f64,
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
    surfaces: Vec<SurfaceId>,
    shape: EdgeShape,
    wedge_angle: f64,
}

/// Finds all edges; `abuts` tells whether a point of a free edge, with the direction into its face, lies on another
/// surface than its own.
pub(crate) fn find_edges(
    mesh: &Mesh,
    shared: &[SharedEdge],
    surfaces: &[Surface],
    of_triangle: &[SurfaceId],
    tolerance: f64,
    abuts: impl Fn(DVec3, DVec3, SurfaceId) -> bool,
) -> Vec<Edge> {
    let mut segments: Vec<Segment> =
        shared.iter().filter_map(|edge| segment(mesh, edge, surfaces, of_triangle, &abuts)).collect();
    // A fixed order of equal keys keeps the result independent of hashing.
    segments.sort_by(|a, b| a.surfaces.cmp(&b.surfaces));
    let groups = straight_groups(mesh, &segments, tolerance);
    groups.into_iter().map(|group| whole(mesh, &segments, &group)).collect()
}

fn segment(
    mesh: &Mesh,
    edge: &SharedEdge,
    surfaces: &[Surface],
    of_triangle: &[SurfaceId],
    abuts: impl Fn(DVec3, DVec3, SurfaceId) -> bool,
) -> Option<Segment> {
    let surface = |face: u32| of_triangle[face as usize];
    let mut around: Vec<SurfaceId> = edge.faces.iter().map(|&(face, _)| surface(face)).collect();
    around.sort_unstable();
    let (shape, wedge_angle) = match edge.faces[..] {
        [(face, _)] => {
            let [start, end] = edge.ends.map(|end| mesh.vertices[end as usize]);
            let inward = edge.inward(mesh, face);
            let on_another = |share| abuts(start.lerp(end, share), inward, surface(face));
            // Three places: an edge that lies on a wall here and there is free elsewhere, and stays free.
            if [0.25, 0.5, 0.75].into_iter().all(on_another) {
                (EdgeShape::Abutting, 0.0)
            } else {
                (EdgeShape::Free, TAU)
            }
        }
        [(a, _), (b, _)] if surface(a) == surface(b) => return None,
        [(a, forward), (b, backward)] if forward != backward => {
            wedge(mesh, edge, [a, b], [a, b].map(|face| &surfaces[surface(face).0 as usize]))
        }
        _ => (EdgeShape::Junction, 0.0),
    };
    around.dedup();
    Some(Segment { ends: edge.ends, surfaces: around, shape, wedge_angle })
}

/// Shape and angle on the front of two faces that agree in orientation.
fn wedge(mesh: &Mesh, edge: &SharedEdge, faces: [u32; 2], surfaces: [&Surface; 2]) -> (EdgeShape, f64) {
    if surfaces[0].plane == surfaces[1].plane {
        return (EdgeShape::Seam, PI);
    }
    let inward = faces.map(|face| edge.inward(mesh, face));
    // The angle from the first face to the second through the air in front of the first.
    let height = surfaces[0].normal.dot(inward[1]);
    let angle = libm::atan2(height, inward[0].dot(inward[1])).rem_euclid(TAU);
    (if angle > PI { EdgeShape::Convex } else { EdgeShape::Concave }, angle)
}

/// Groups of segments that continue one another: the same surfaces and shape, a common vertex, one line.
fn straight_groups(mesh: &Mesh, segments: &[Segment], tolerance: f64) -> Vec<Vec<usize>> {
    let mut connected = Connected::new(segments.len());
    let mut at_vertex: HashMap<u32, Vec<usize>> = HashMap::new();
    for (index, segment) in segments.iter().enumerate() {
        for end in segment.ends {
            let others = at_vertex.entry(end).or_default();
            for &other in others.iter() {
                if continues(mesh, &segments[other], segment, end, tolerance) {
                    connected.join(other as u32, index as u32);
                }
            }
            others.push(index);
        }
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); segments.len()];
    for index in 0..segments.len() {
        groups[connected.root(index as u32) as usize].push(index);
    }
    groups.retain(|group| !group.is_empty());
    groups
}

fn continues(mesh: &Mesh, a: &Segment, b: &Segment, end: u32, tolerance: f64) -> bool {
    let away = |segment: &Segment| {
        let other = if segment.ends[0] == end { segment.ends[1] } else { segment.ends[0] };
        mesh.vertices[other as usize] - mesh.vertices[end as usize]
    };
    let (u, v) = (away(a), away(b));
    // Height of the shorter segment's end over the line of the longer one.
    let aside = u.cross(v).length() / u.length().max(v.length());
    a.surfaces == b.surfaces && a.shape == b.shape && u.dot(v) < 0.0 && aside <= tolerance
}

/// The edge that a straight group of segments makes.
fn whole(mesh: &Mesh, segments: &[Segment], group: &[usize]) -> Edge {
    let first = &segments[group[0]];
    let [start, end] = first.ends.map(|end| mesh.vertices[end as usize]);
    let points = group.iter().flat_map(|&i| segments[i].ends).map(|end| mesh.vertices[end as usize]);
    let along = |point: &DVec3| (*point - start).dot(end - start);
    let ends = points.fold([start, end], |[low, high], point| {
        let low = if along(&point) < along(&low) { point } else { low };
        [low, if along(&point) > along(&high) { point } else { high }]
    });
    let Segment { shape, wedge_angle, .. } = *first;
    Edge { ends, shape, surfaces: first.surfaces.clone(), wedge_angle }
}
