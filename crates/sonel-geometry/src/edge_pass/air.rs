//! The air about an edge: whether a point is in the sector into which it diffracts.

use crate::AirSector;
use glam::DVec3;
use std::f64::consts::TAU;

/// The sector of air above π about an edge; there is room for one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Air {
    inward: DVec3,
    normal: DVec3,
    angle: f64,
    /// Sine and cosine of the angle.
    turn: (f64, f64),
}

/// Height over a face, relative to the distance from the edge, that rounding may hide.
const GRAZING: f64 = 1e-12;

impl Air {
    /// The air of `sector`.
    pub fn new(sector: &AirSector) -> Self {
        let AirSector { inward, normal, angle, .. } = *sector;
        Self { inward, normal, angle, turn: libm::sincos(angle) }
    }

    /// Whether the sector holds what is at `offset` from a point of the edge.
    ///
    /// In front of the first face it does, as the sector spans more than π. Behind that it does in front of the second
    /// one. The angle is computed only where rounding leaves the sign of that height open.
    #[inline]
    pub fn holds(&self, offset: DVec3) -> bool {
        let above = offset.dot(self.normal);
        if above >= 0.0 || self.angle >= TAU {
            return true;
        }
        let inward = offset.dot(self.inward);
        let (sine, cosine) = self.turn;
        let height = sine * inward - cosine * above;
        if height.abs() > GRAZING * (above.abs() + inward.abs()) {
            return height > 0.0;
        }
        libm::atan2(above, inward).rem_euclid(TAU) <= self.angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Side, SurfaceId};
    use std::f64::consts::PI;

    #[test]
    fn signs_of_heights_say_what_angles_say() {
        let [inward, normal] = [DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.8, 0.6, 0.0)];
        for angle in [PI + 1e-4, 1.25 * PI, 1.5 * PI, 1.9 * PI, TAU - 1e-9, TAU] {
            let air = Air::new(&AirSector { faces: [(SurfaceId(0), Side::Front); 2], inward, normal, angle });
            let (mut held, mut count) = (0, 0);
            // Turns on both faces, just beside them, and all around.
            let turns = (0..1000).map(|step| 0.007 * f64::from(step));
            let beside = [0.0, PI, angle, TAU].into_iter().flat_map(|turn| {
                [0.0, 1e-16, 1e-15, 1e-13, 1e-6].into_iter().flat_map(move |by| [turn - by, turn + by])
            });
            for turn in turns.chain(beside) {
                let (sine, cosine) = libm::sincos(turn);
                let offset = 3.0 * (cosine * inward + sine * normal) + 7.0 * DVec3::Z;
                let found = libm::atan2(offset.dot(normal), offset.dot(inward)).rem_euclid(TAU);
                let expected = angle >= TAU || found <= angle;
                assert_eq!(air.holds(offset), expected, "{turn} in {angle}");
                count += 1;
                held += usize::from(expected);
            }
            assert!(held > count / 2 && (held < count || angle > TAU - 1e-6));
        }
    }
}
