//! Orthonormal frames about a normal, without branches on nearly parallel axes.
//!
//! Reference: [Duff2017] (docs/references.md).

use glam::Vec3;

/// A right-handed orthonormal frame whose third axis is the normal.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// First tangent, unit length.
    pub tangent: Vec3,
    /// Second tangent, unit length.
    pub bitangent: Vec3,
    /// The normal, unit length.
    pub normal: Vec3,
}

impl Frame {
    /// The frame about the unit vector `normal`.
    #[must_use]
    pub fn about(normal: Vec3) -> Self {
        let sign = 1.0_f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// A vector given in the frame, in the frame's surroundings.
    #[inline]
    #[must_use]
    pub fn outward(&self, local: Vec3) -> Vec3 {
        self.tangent * local.x + self.bitangent * local.y + self.normal * local.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_orthonormal_for_every_normal() {
        for i in 0..1000 {
            let normal = crate::warp::uniform_sphere(crate::ScrambledSobol::numbered(3, 0, 0).point(i));
            for normal in [normal, Vec3::Z, Vec3::NEG_Z] {
                let frame = Frame::about(normal);
                for (a, b) in [
                    (frame.tangent, frame.bitangent),
                    (frame.tangent, frame.normal),
                    (frame.bitangent, frame.normal),
                ] {
                    assert!(a.dot(b).abs() < 1e-6);
                }
                assert!((frame.tangent.cross(frame.bitangent) - frame.normal).length() < 1e-6);
            }
        }
    }
}
