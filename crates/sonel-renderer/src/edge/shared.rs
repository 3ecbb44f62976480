//! Planes in which faces of several objects lie, as the sides of boxes in a row.
//!
//! In such a plane edges of all of them are in line, one behind the other, and what each leaves would go over all the next ones. Paths over that many
//! edges are not followed, so that the field is another one on either side of the plane. A receiver next to it hears what is between both.

use glam::DVec3;
use sonel_geometry::Geometry;

use super::mirror::{PlaneMirror, distance_to_line};
use super::world::{RoomEdge, World};
use crate::direct::direct_path;

/// How far from such a plane the field is what it is on that side [m]: three decibels more on one side than on the other then are no more than a
/// tenth of one in a millimetre.
const BESIDE: f64 = 0.025;
/// The same near an edge in the plane, as a share of the distance from that.
const NEAR_AN_EDGE: f64 = 0.5;

/// A plane in which faces of several objects lie, and the edges of these.
pub(super) struct SharedPlane {
    plane: PlaneMirror,
    edges: Vec<[DVec3; 2]>,
}

/// Two places on either side of a receiver next to a shared plane.
pub(crate) struct Beside {
    pub places: [DVec3; 2],
    /// How far it is on the way from the first place to the second: 0 … 1.
    pub share: f64,
}

/// All planes that `room` has edges apart in.
#[must_use]
pub(super) fn shared_planes(room: &World) -> Vec<SharedPlane> {
    let mut planes: Vec<SharedPlane> = Vec::new();
    for way in room.apart.iter().filter(|way| way.is_short()) {
        let [one, other] = way.sides.each_ref().map(|side| &room.edges[side.outer()].faces);
        let of_both = one.iter().filter(|face| other.iter().any(|other| other.plane == face.plane));
        for face in of_both {
            if planes.iter().any(|known| known.plane.plane == face.plane) {
                continue;
            }
            let in_plane = |edge: &&RoomEdge| edge.faces.iter().any(|of| of.plane == face.plane);
            let ends = |edge: &RoomEdge| [0.0, edge.wedge.length()].map(|end| edge.wedge.at(end));
            let edges = room.edges.iter().filter(in_plane).map(ends).collect();
            planes.push(SharedPlane { plane: *face, edges });
        }
    }
    planes
}

impl SharedPlane {
    /// The places beside the plane if `place` [m] is next to it and no face is between them.
    #[must_use]
    pub fn beside(&self, geometry: &Geometry, place: DVec3) -> Option<Beside> {
        let height = self.plane.height(place);
        if height.abs() >= BESIDE {
            return None;
        }
        let away = self.edges.iter().map(|ends| distance_to_line(place, *ends)).fold(f64::INFINITY, f64::min);
        let far = BESIDE.min(NEAR_AN_EDGE * away);
        if height.abs() >= far {
            return None;
        }
        let places = [-far, far].map(|to| place + (to - height) * self.plane.normal());
        direct_path(geometry, places[0], places[1])?;
        Some(Beside { places, share: 0.5 * (height / far + 1.0) })
    }
}
