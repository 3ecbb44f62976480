//! Planes next to which a receiver hears what is between both of their sides.
//!
//! In a plane in which faces of several objects lie, as the sides of boxes in a row, edges of all of them are in line, one behind the other, and
//! what each leaves would go over all the next ones. Paths over that many edges are not followed, so that the field is another one on either side
//! of the plane. So it is where what mirrors show goes over too many edges for all to be followed.
//!
//! Where the source is next to the plane of a face, both forms of what goes over two edges of it or more (`sonel_diffraction::face`) are asked for
//! within as many millimetres, and beside corners they are not the same.

use glam::DVec3;
use sonel_geometry::Geometry;

use super::mirror::{PlaneMirror, distance_to_line};
use super::world::{RoomEdge, World};
use crate::direct::direct_path;

/// How far from a plane that objects share the field is what it is on that side [m]: three decibels more on one side than on the other then are no
/// more than a tenth of one in a millimetre.
const BESIDE_SHARED: f64 = 0.025;
/// The same of other planes: half a decibel.
const BESIDE: f64 = 0.006;
/// How near to a plane the source grazes it [m]: from there on a receiver passes from one form to the other within a centimetre.
const GRAZED: f64 = 0.005;
/// How far from a plane the field is what it is on that side near an edge in it, as a share of the distance from that.
const NEAR_AN_EDGE: f64 = 0.5;

/// A plane in which faces lie, and the edges of these.
pub(super) struct FacePlane {
    plane: PlaneMirror,
    edges: Vec<[DVec3; 2]>,
    /// Whether faces of several objects lie in it.
    is_shared: bool,
    /// Whether all that mirrors show is followed from one edge in it to the next.
    is_whole: bool,
}

/// Two places on either side of a receiver.
pub(crate) struct Beside {
    pub places: [DVec3; 2],
    /// How far it is on the way from the first place to the second: 0 … 1.
    pub share: f64,
}

/// All planes that `room` has faces of edges in, those that objects share before the others; `is_whole` is whether all passages by way of mirrors
/// are followed.
#[must_use]
pub(super) fn face_planes(room: &World, is_whole: bool) -> Vec<FacePlane> {
    let mut planes: Vec<FacePlane> = Vec::new();
    for edge in &room.edges {
        for face in &edge.faces {
            if planes.iter().any(|known| known.plane.plane == face.plane) {
                continue;
            }
            let in_plane = |edge: &RoomEdge| edge.faces.iter().any(|of| of.plane == face.plane);
            let ends = |edge: &RoomEdge| [0.0, edge.wedge.length()].map(|end| edge.wedge.at(end));
            let edges = room.edges.iter().filter(|edge| in_plane(edge)).map(ends).collect();
            let mut apart = room.apart.iter().filter(|way| way.is_short());
            let is_shared = apart.any(|way| way.sides.iter().all(|side| in_plane(&room.edges[side.outer()])));
            planes.push(FacePlane { plane: *face, edges, is_shared, is_whole });
        }
    }
    planes.sort_by_key(|plane| !plane.is_shared);
    planes
}

impl FacePlane {
    /// The places beside the plane if `receiver` [m] is next to it and no face is between them; where no paths are missing, if `source` [m] is
    /// next to it, too.
    #[must_use]
    pub fn beside(&self, geometry: &Geometry, source: DVec3, receiver: DVec3) -> Option<Beside> {
        let height = self.plane.height(receiver);
        let farthest = if self.is_shared { BESIDE_SHARED } else { BESIDE };
        let is_grazed = self.plane.height(source).abs() < GRAZED;
        let is_smooth = self.is_whole && !self.is_shared && !is_grazed;
        if is_smooth || height.abs() >= farthest {
            return None;
        }
        let to_edges = self.edges.iter().map(|ends| distance_to_line(receiver, *ends));
        let far = farthest.min(NEAR_AN_EDGE * to_edges.fold(f64::INFINITY, f64::min));
        if height.abs() >= far {
            return None;
        }
        let places = [-far, far].map(|to| receiver + (to - height) * self.plane.normal());
        direct_path(geometry, places[0], places[1])?;
        Some(Beside { places, share: 0.5 * (height / far + 1.0) })
    }
}
