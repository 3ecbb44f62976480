//! Images of a source, and which of them are one.

use glam::DVec3;
use sonel_geometry::PlaneId;

use super::Listening;
use super::chain::Chain;
use super::mirror::PlaneMirror;
use crate::mirror::MirrorArrival;

/// Positions of images that differ by no more than this many resolutions are the same.
const SAME_PLACE: f64 = 64.0;

/// Where a source seems to be in mirrors. In one place several images may be, as what the top of a box would show and what its underside shows after the
/// floor: no more than one of them reaches a receiver, and which it is the mirrors tell, whatever their order.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SourceImage {
    /// About the scene's centre [m].
    pub position: DVec3,
    /// Planes of the mirrors, in ascending order.
    planes: Vec<PlaneId>,
}

impl SourceImage {
    fn new(position: DVec3, planes: impl IntoIterator<Item = PlaneId>) -> Self {
        let mut planes: Vec<PlaneId> = planes.into_iter().collect();
        planes.sort_unstable();
        Self { position, planes }
    }

    /// The one that reaches `receiver` (about the scene's centre [m]) as `found`.
    #[must_use]
    pub fn of(found: &MirrorArrival<'_>, receiver: DVec3) -> Self {
        Self::new(receiver + found.towards * found.length, found.planes.iter().copied())
    }

    /// At `position` [m], in the mirrors of `chain`.
    #[must_use]
    pub fn in_mirrors(position: DVec3, chain: &Chain) -> Self {
        Self::new(position, chain.mirrors().iter().map(|mirror| mirror.plane))
    }

    /// Its image in a `face`.
    #[must_use]
    pub fn in_face(&self, face: &PlaneMirror) -> Self {
        Self::new(face.image(self.position), self.planes.iter().copied().chain([face.plane]))
    }

    /// Whether both are one, as far as positions are told apart.
    #[must_use]
    pub fn is(&self, other: &Self, at: &Listening<'_>) -> bool {
        self.position.distance(other.position) <= same_place(at) && self.planes == other.planes
    }
}

/// How far positions may differ that are the same [m].
#[must_use]
pub(crate) fn same_place(at: &Listening<'_>) -> f64 {
    SAME_PLACE * f64::from(at.geometry.resolution())
}
