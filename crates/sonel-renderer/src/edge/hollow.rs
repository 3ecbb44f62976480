//! Hollow corners of other angles than 90°: images in both of their mirrors begin and end there.
//!
//! Such corners do not diffract (docs/physics.md §5), so that nothing completes what they cut off: half a decibel at once in rooms without right
//! angles. A receiver next to the boundary hears what is between both sides of it.

use glam::DVec3;
use sonel_geometry::Geometry;

use super::beside::Beside;
use super::extent::Extent;
use super::mirror::PlaneMirror;
use crate::direct::direct_path;

/// How far from a boundary the field is what it is on that side [m]: half a decibel then is less than a tenth in a millimetre.
const BESIDE: f64 = 0.006;
/// The same near the corner, as a share of the distance from that.
const NEAR_THE_CORNER: f64 = 0.5;
/// How far off a corner, in lifts, it is looked from.
const OFF_THE_CORNER: f64 = 16.0;

/// Two mirrors that meet.
pub(super) struct HollowCorner {
    mirrors: [PlaneMirror; 2],
    /// A point of the line in which their planes meet [m], and its unit direction.
    at: DVec3,
    along: DVec3,
}

/// The corners of `planes`, neither parallel nor at a right angle, that may meet.
#[must_use]
pub(super) fn hollow_corners(geometry: &Geometry, planes: &[PlaneMirror]) -> Vec<HollowCorner> {
    let extents: Vec<Extent> = planes.iter().map(|plane| Extent::of_plane(geometry, plane)).collect();
    let mut corners = Vec::new();
    for (index, one) in planes.iter().enumerate() {
        for (before, other) in planes[..index].iter().enumerate() {
            if !one.is_across(other) && extents[index].touches(&extents[before]) {
                corners.extend(HollowCorner::of([*other, *one]));
            }
        }
    }
    corners
}

impl HollowCorner {
    fn of(mirrors: [PlaneMirror; 2]) -> Option<Self> {
        let [one, other] = mirrors;
        let along = one.normal().cross(other.normal()).try_normalize()?;
        // From the origin to the first plane, and in that to the second.
        let at = -one.height(DVec3::ZERO) * one.normal();
        let towards = along.cross(one.normal());
        let at = at - towards * (other.height(at) / towards.dot(other.normal()));
        Some(Self { mirrors, at, along })
    }

    /// The places beside the boundary of an image of `source` in both mirrors if `receiver` is next to it.
    #[must_use]
    pub fn beside(&self, geometry: &Geometry, source: DVec3, receiver: DVec3) -> Option<Beside> {
        let [one, other] = &self.mirrors;
        let is_before = |end: DVec3| self.mirrors.iter().all(|mirror| mirror.height(end) > 0.0);
        if !is_before(source) || !is_before(receiver) {
            return None;
        }
        let images = [other.image(one.image(source)), one.image(other.image(source))];
        images.into_iter().find_map(|image| self.beside_boundary(geometry, source, image, receiver))
    }

    fn beside_boundary(
        &self,
        geometry: &Geometry,
        source: DVec3,
        image: DVec3,
        receiver: DVec3,
    ) -> Option<Beside> {
        let [to_image, to_receiver] = [image, receiver].map(|end| end - self.at);
        let normal = self.along.cross(to_image).try_normalize()?;
        let height = normal.dot(to_receiver);
        let away = to_receiver.reject_from_normalized(self.along);
        let far = BESIDE.min(NEAR_THE_CORNER * away.length());
        if height.abs() >= far
            || away.dot(to_image) >= 0.0
            || !self.is_seen(geometry, [source, image, receiver])
        {
            return None;
        }
        let places = [-far, far].map(|to| receiver + (to - height) * normal);
        direct_path(geometry, places[0], places[1])?;
        Some(Beside { places, share: 0.5 * (height / far + 1.0) })
    }

    /// Whether the corner is there where the way from the `image` to the receiver passes it, and seen from both ends.
    fn is_seen(&self, geometry: &Geometry, [source, image, receiver]: [DVec3; 3]) -> bool {
        let about = |end: DVec3| {
            let along = (end - self.at).dot(self.along);
            (along, (end - self.at).reject_from_normalized(self.along).length())
        };
        let (from, to) = (about(image), about(receiver));
        let place = self.at + self.along * ((from.0 * to.1 + to.0 * from.1) / (from.1 + to.1));
        let [one, other] = &self.mirrors;
        let off = OFF_THE_CORNER * f64::from(geometry.lift());
        let looks = place + (one.normal() + other.normal()) * off;
        one.is_felt(geometry, place, other.normal())
            && other.is_felt(geometry, place, one.normal())
            && [source, receiver].into_iter().all(|end| direct_path(geometry, looks, end).is_some())
    }
}
