//! Walks that find out which places are in one air.

use core::f64::consts::TAU;

use glam::{DVec3, Vec3};
use sonel_geometry::{Departure, Geometry, Hit};

/// A walk through one air: in every step some way towards what is met in an evenly spread direction.
pub(crate) struct Walk<'a> {
    geometry: &'a Geometry,
    /// Local position [m].
    pub(crate) at: Vec3,
    steps: u32,
}

impl<'a> Walk<'a> {
    pub(crate) fn new(geometry: &'a Geometry, at: Vec3) -> Self {
        Self { geometry, at, steps: 0 }
    }

    /// Whether nothing is between here and a local position [m].
    pub(crate) fn sees(&self, place: Vec3) -> bool {
        !self.geometry.is_blocked(Departure::free(self.at), place)
    }

    /// Goes on; what is met in its direction.
    pub(crate) fn step(&mut self) -> Option<Hit> {
        self.steps += 1;
        // Additive recurrence on the powers of the root of x⁴ = x + 1: evenly spread in three dimensions.
        let [u, v, share] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3]
            .map(|step: f64| (f64::from(self.steps) * step).fract());
        let (height, (sine, cosine)) = (1.0 - 2.0 * u, libm::sincos(TAU * v));
        let across = (1.0 - height * height).sqrt();
        let direction = DVec3::new(across * cosine, across * sine, height).as_vec3();
        let hit = self.geometry.closest_hit(Departure::free(self.at), direction)?;
        // Off the surfaces, where rounding could lead to the wrong side of another one.
        self.at += direction * (hit.distance * (0.1 + 0.8 * share as f32));
        Some(hit)
    }
}
