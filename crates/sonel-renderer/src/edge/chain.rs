//! Mirrors that sound meets one after the other.

use glam::DVec3;
use sonel_geometry::Geometry;

use super::mirror::{PlaneMirror, feet, reflects};

/// Mirrors in the order in which they are met. Two at a right angle make the same image in either order and are met in either.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chain {
    mirrors: Vec<PlaneMirror>,
}

impl Chain {
    /// Of `mirrors`, the first one that is met first.
    #[must_use]
    pub fn of(mirrors: &[PlaneMirror]) -> Self {
        Self { mirrors: mirrors.to_vec() }
    }

    #[must_use]
    pub fn mirrors(&self) -> &[PlaneMirror] {
        &self.mirrors
    }

    /// Whether `other` is this one.
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        self.order() == other.order()
            && self.mirrors.iter().zip(&other.mirrors).all(|(one, other)| one.is(other))
    }

    /// On the way back.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self { mirrors: self.mirrors.iter().rev().copied().collect() }
    }

    /// Number of reflections.
    #[must_use]
    pub fn order(&self) -> u32 {
        self.mirrors.len() as u32
    }

    /// Whether its two mirrors are met in either order.
    #[must_use]
    pub fn is_either_way(&self) -> bool {
        matches!(&self.mirrors[..], [one, other] if one.is_across(other))
    }

    /// Where what is at `point` seems to be behind all mirrors.
    #[must_use]
    pub fn image(&self, point: DVec3) -> DVec3 {
        self.mirrors.iter().fold(point, |point, mirror| mirror.image(point))
    }

    /// Image of `face` behind all mirrors.
    #[must_use]
    pub fn image_of(&self, face: &PlaneMirror) -> PlaneMirror {
        self.mirrors.iter().fold(*face, |face, mirror| mirror.image_of(&face))
    }

    /// Whether sound can come from `from` to the first mirror, or go from the last one to `to`, as far as their planes are concerned.
    #[must_use]
    pub fn is_met(&self, from: DVec3, to: DVec3) -> bool {
        let is_before =
            |mirrors: &[PlaneMirror], point| mirrors.iter().all(|mirror| mirror.height(point) > 0.0);
        let [first, last] = match &self.mirrors[..] {
            both if self.is_either_way() => [both; 2],
            [first, .., last] => [first, last].map(std::slice::from_ref),
            one => [one; 2],
        };
        is_before(first, from) || is_before(last, to)
    }

    /// All mirrors, each with where the straight way between two places meets it [m]; none where it does not meet all of them.
    #[must_use]
    pub fn feet(&self, from: DVec3, to: DVec3) -> Vec<(PlaneMirror, DVec3)> {
        let in_order = |mirrors: &[PlaneMirror]| -> Option<Vec<(PlaneMirror, DVec3)>> {
            feet(mirrors, from, to).map(|feet| mirrors.iter().copied().zip(feet).collect())
        };
        let back = || in_order(self.reversed().mirrors()).filter(|_| self.is_either_way());
        in_order(&self.mirrors).or_else(back).unwrap_or_default()
    }

    /// Whether sound goes over all mirrors from `from` to `to`.
    #[must_use]
    pub fn reaches(&self, geometry: &Geometry, from: DVec3, to: DVec3) -> bool {
        let back = || [self.mirrors[1], self.mirrors[0]];
        reflects(geometry, &self.mirrors, from, to)
            || self.is_either_way() && reflects(geometry, &back(), from, to)
    }
}
