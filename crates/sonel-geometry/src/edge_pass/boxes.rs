//! Boxes about edges, four by four: which of them a search need not enter.
//!
//! A box is left out only if nothing in it can be found, whatever rounding does.

use super::question::{Point, Ray};
use glam::{DVec3, Vec4};

/// Boxes that are tested together.
pub(super) const QUAD: usize = 4;
/// Roundings that the bounds of a box and a distance to it suffer, in units of the last place of the coordinates.
const ALLOWANCE: f32 = 16.0;

/// A box about edges.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Bounds {
    /// Its lower corner [m].
    pub low: DVec3,
    /// Its upper corner [m].
    pub high: DVec3,
    /// Largest component of a unit vector square to any of the edges: what is passed at a distance is no farther off along an
    /// axis than by this part of it, and not at all along the edge.
    pub aside: DVec3,
}

/// Up to four boxes, by axis.
#[derive(Debug, Clone)]
pub(super) struct Boxes {
    low: [Vec4; 3],
    high: [Vec4; 3],
    aside: [Vec4; 3],
    /// Bits of those that are there.
    present: u32,
}

impl Boxes {
    /// Those of at most four bounds.
    pub fn new(bounds: &[Bounds]) -> Self {
        let gather = |value: &dyn Fn(&Bounds) -> f64| {
            let lane = |lane: usize| bounds.get(lane).map_or(0.0, |bounds| value(bounds) as f32);
            Vec4::from_array(std::array::from_fn(lane))
        };
        Self {
            low: [0, 1, 2].map(|axis| gather(&|bounds| bounds.low[axis])),
            high: [0, 1, 2].map(|axis| gather(&|bounds| bounds.high[axis])),
            aside: [0, 1, 2].map(|axis| gather(&|bounds| bounds.aside[axis])),
            present: (1 << bounds.len()) - 1,
        }
    }

    /// The boxes that may hold a point within reach of the part `from` … `to` of a ray, and square to it and to its edge
    /// from there: where the ray is in the grown box, between the planes across it at both ends of that.
    #[inline]
    pub fn beside(&self, ray: &Ray, part: [f32; 2]) -> u32 {
        if self.present == 0 {
            return 0;
        }
        let slip = Vec4::splat(ALLOWANCE * ray.rounding);
        let (mut nearest, mut farthest) = (-slip, slip);
        for axis in 0..3 {
            let direction = ray.direction[axis];
            let low = self.low[axis] - ray.origin[axis];
            let high = self.high[axis] - ray.origin[axis];
            let (one, other) = (low * direction, high * direction);
            nearest += one.min(other);
            farthest += one.max(other);
        }
        let [enter, leave] = self.grown(ray, part, slip);
        (enter.max(nearest).cmple(leave + slip) & farthest.cmpge(enter)).bitmask() & self.present
    }

    /// The boxes that may hold a point within reach of the part `from` … `to` of a ray, and square to its edge from there: where the
    /// ray is in the grown box.
    #[inline]
    pub fn abreast(&self, ray: &Ray, part: [f32; 2]) -> u32 {
        if self.present == 0 {
            return 0;
        }
        let slip = Vec4::splat(ALLOWANCE * ray.rounding);
        let [enter, leave] = self.grown(ray, part, slip);
        enter.cmple(leave + slip).bitmask() & self.present
    }

    /// Where the part of a ray enters and leaves the boxes grown by its reach [m].
    #[inline]
    fn grown(&self, ray: &Ray, [from, to]: [f32; 2], slip: Vec4) -> [Vec4; 2] {
        let (mut enter, mut leave) = (Vec4::splat(from), Vec4::splat(to));
        for axis in 0..3 {
            let low = self.low[axis] - ray.origin[axis];
            let high = self.high[axis] - ray.origin[axis];
            let grown = self.aside[axis] * ray.reach + slip;
            let (one, other) = ((low - grown) * ray.inverse[axis], (high + grown) * ray.inverse[axis]);
            enter = enter.max(one.min(other));
            leave = leave.min(one.max(other));
        }
        [enter, leave]
    }

    /// The boxes that may hold a point nearer than the square of a distance [m²].
    #[inline]
    pub fn about(&self, point: &Point, squared: f32) -> u32 {
        if self.present == 0 {
            return 0;
        }
        let slip = Vec4::splat(ALLOWANCE * point.rounding);
        let mut sum = Vec4::ZERO;
        for axis in 0..3 {
            let (below, above) =
                (self.low[axis] - point.position[axis], point.position[axis] - self.high[axis]);
            let outside = (below.max(above) - slip).max(Vec4::ZERO);
            sum += outside * outside;
        }
        sum.cmple(Vec4::splat(squared)).bitmask() & self.present
    }
}
