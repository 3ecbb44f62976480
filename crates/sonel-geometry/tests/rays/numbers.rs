//! Uniform numbers for tests: SplitMix64, which needs no crate and no care.
#![allow(dead_code)] // each of the programs that include this file uses some of it

use glam::{DVec3, Vec3, dvec3};

pub(crate) struct Numbers(pub u64);

impl Numbers {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }

    /// Uniform in a box.
    pub(crate) fn within(&mut self, low: DVec3, high: DVec3) -> DVec3 {
        low + (high - low) * dvec3(self.unit(), self.unit(), self.unit())
    }

    /// Uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let point = self.within(DVec3::NEG_ONE, DVec3::ONE);
            if (1e-3..=1.0).contains(&point.length_squared()) {
                return point.normalize();
            }
        }
    }

    /// Lambert's law about a unit normal: a point of the sphere that touches the surface.
    pub(crate) fn lambert(&mut self, normal: DVec3) -> Vec3 {
        loop {
            let direction = normal + self.direction();
            if direction.length_squared() > 1e-12 {
                return direction.normalize().as_vec3();
            }
        }
    }
}
