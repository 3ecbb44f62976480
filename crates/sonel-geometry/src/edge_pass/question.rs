//! What is asked of boxes and blocks, in f32, with how far rounding may take an answer.

use glam::DVec3;

/// A part of a straight line, and how far beside it something may be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    /// Where it starts [m].
    pub origin: [f32; 3],
    /// Unit direction.
    pub direction: [f32; 3],
    /// One over it, finite.
    pub inverse: [f32; 3],
    /// Largest distance [m].
    pub reach: f32,
    /// Largest of all lengths that occur [m].
    pub scale: f32,
    /// Unit in the last place of such a length [m].
    pub rounding: f32,
}

/// A point about which something may be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    /// Where it is [m].
    pub position: [f32; 3],
    /// Largest of all lengths that occur [m].
    pub scale: f32,
    /// Unit in the last place of such a length [m].
    pub rounding: f32,
}

/// Component of a direction below which it is taken as this, so that its inverse is finite.
const LEAST_SLOPE: f32 = 1e-20;

impl Ray {
    /// The line from `origin` in a unit `direction` up to `to`, in a scene of edges that are within `extent` of its centre [m].
    pub fn new(origin: DVec3, direction: DVec3, to: f64, reach: f64, extent: f64) -> Self {
        let direction = direction.as_vec3().to_array();
        let scale = (origin.abs().max_element() + extent + to + reach) as f32;
        Self {
            origin: origin.as_vec3().to_array(),
            inverse: direction.map(|slope| 1.0 / if slope.abs() < LEAST_SLOPE { LEAST_SLOPE } else { slope }),
            direction,
            reach: reach as f32,
            scale,
            rounding: f32::EPSILON * scale,
        }
    }
}

impl Point {
    /// A point in a scene of edges that are within `extent` of its centre [m].
    pub fn new(position: DVec3, extent: f64) -> Self {
        let scale = (position.abs().max_element() + extent) as f32;
        Self { position: position.as_vec3().to_array(), scale, rounding: f32::EPSILON * scale }
    }
}

/// The lanes whose bits are set.
#[inline]
pub(super) fn lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (lane < 32).then_some(lane)
    })
}
