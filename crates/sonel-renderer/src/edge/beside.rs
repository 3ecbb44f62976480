//! Planes next to which a receiver hears what is between both of their sides.
//!
//! In the plane of a face what comes over one of its edges is cut off for that over the next ones to take over, within micrometres. Where that is not
//! all there, or not the same to the last tenth of a decibel, the field is another one on either side of the plane: paths are not followed over every
//! number of edges; both forms of what goes over two (`sonel_diffraction::face`) lack something beside corners. In a plane in which faces of
//! several objects lie, as the sides of boxes in a row, edges of all of them are in line, one behind the other.

use glam::DVec3;
use sonel_geometry::Geometry;

use super::mirror::{PlaneMirror, distance_to_line};
use super::world::{RoomEdge, World};
use crate::direct::direct_path;

/// How far from a plane of faces the field is what it is on that side [m]: a change of 0.8 dB from one side to the other then is less than a tenth
/// of a decibel in a millimetre, and the field, taken to be straight between both sides, some hundredths off.
const BESIDE: f64 = 0.005;
/// The same of planes that objects share: 3 dB and more.
const BESIDE_SHARED: f64 = 0.025;
/// Nearer to an edge in the plane [m], where fields change faster, it is less, in proportion.
const NEAR_AN_EDGE: f64 = 0.1;

/// A plane in which faces lie, and the edges of these.
pub(super) struct FacePlane {
    plane: PlaneMirror,
    edges: Vec<[DVec3; 2]>,
    /// Up to how far from it a receiver is next to it [m].
    farthest: f64,
}

/// Two places on either side of a receiver.
pub(crate) struct Beside {
    pub places: [DVec3; 2],
    /// How far it is on the way from the first place to the second: 0 … 1.
    pub share: f64,
}

/// All planes that `room` has faces of edges in. Faces of several objects are in one plane where what goes over edges apart goes over two in it.
#[must_use]
pub(super) fn face_planes(room: &World) -> Vec<FacePlane> {
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
            let farthest = if is_shared { BESIDE_SHARED } else { BESIDE };
            planes.push(FacePlane { plane: *face, edges, farthest });
        }
    }
    planes
}

impl FacePlane {
    /// The places beside the plane if `receiver` [m] is next to it and no face is between them.
    #[must_use]
    pub fn beside(&self, geometry: &Geometry, receiver: DVec3) -> Option<Beside> {
        let height = self.plane.height(receiver);
        if height.abs() >= self.farthest {
            return None;
        }
        let to_edges = self.edges.iter().map(|ends| distance_to_line(receiver, *ends));
        let far =
            self.farthest * to_edges.fold(1.0, |least: f64, distance| least.min(distance / NEAR_AN_EDGE));
        if height.abs() >= far {
            return None;
        }
        let places = [-far, far].map(|to| receiver + (to - height) * self.plane.normal());
        direct_path(geometry, places[0], places[1])?;
        Some(Beside { places, share: 0.5 * (height / far + 1.0) })
    }
}
