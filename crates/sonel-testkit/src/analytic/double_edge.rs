//! Two parallel edges, of a thick barrier or apart: every pair of secondary sources added up.
//!
//! H(k) = s (ν₁ν₂/16π²) ∫∫ Σβ₁ Σβ₂ e^(−jk(m₁+m₂+m₃))/(m₁m₂m₃) dz₁ dz₂, s = ½ along a face and 1 through the air, on the real edges, which
//! fade out far from the shortest way so that they have no ends. Slow, and good to a per cent.
//!
//! Reference: [Svensson1999] (docs/references.md).

use std::f64::consts::PI;

/// Points along each edge per wavelength, and per distance between the edges.
const POINTS: [f64; 2] = [16.0, 5.0];
/// Reach of the edges beyond source and receiver [m], and the part of it over which they fade.
const REACH: f64 = 24.0;
const FADE: f64 = 0.7;

/// Two edges.
#[derive(Debug, Clone, Copy)]
pub struct DoubleEdge {
    /// Angles of the air at both edges [rad].
    pub angles: [f64; 2],
    /// Angle about each at which the other one is [rad]: 0 at both where their first faces are one.
    pub joints: [f64; 2],
    /// (distance from the first edge [m], angle from its first face [rad], along [m]).
    pub source: (f64, f64, f64),
    /// (distance from the second edge [m], angle from its first face [rad], along [m]).
    pub receiver: (f64, f64, f64),
    /// Distance between the edges [m].
    pub width: f64,
}

impl DoubleEdge {
    /// Pressure (re, im) that goes over both edges, of a source of free field e^(−jkr)/r, at wave number `k` [1/m].
    #[must_use]
    pub fn pressure(&self, k: f64) -> (f64, f64) {
        let step = (2.0 * PI / k / POINTS[0]).min(self.width / POINTS[1]);
        let middle = 0.5 * (self.source.2 + self.receiver.2);
        let count = (REACH / step) as i32;
        let at = |i: i32| middle + f64::from(i) * step;
        let ((rs, ts, zs), (rr, tr, zr)) = (self.source, self.receiver);
        let mut sum = (0.0, 0.0);
        for i in -count..=count {
            for j in -count..=count {
                let (a, b) = (at(i), at(j));
                let (m1, m2, m3) = (rs.hypot(a - zs), self.width.hypot(a - b), rr.hypot(b - zr));
                let about = [
                    (m1 * m2 + (a - zs) * (a - b)) / (rs * self.width),
                    (m2 * m3 + (b - a) * (b - zr)) / (self.width * rr),
                ];
                let first = beta(self.angles[0], [ts, self.joints[0]], about[0]);
                let second = beta(self.angles[1], [tr, self.joints[1]], about[1]);
                let fade = fade(a - middle) * fade(b - middle);
                let strength = fade * first * second / (m1 * m2 * m3);
                let phase = k * (m1 + m2 + m3);
                sum.0 += strength * phase.cos();
                sum.1 -= strength * phase.sin();
            }
        }
        let nu = self.angles.map(|angle| PI / angle);
        let along_a_face = self.joints.iter().all(|&joint| joint <= 0.0);
        let factor = if along_a_face { 0.5 } else { 1.0 } * nu[0] * nu[1] / (16.0 * PI * PI) * step * step;
        (sum.0 * factor, sum.1 * factor)
    }
}

/// Σ sin νφ/(cosh νη − cos νφ) between two angles.
fn beta(angle: f64, [one, other]: [f64; 2], cosh: f64) -> f64 {
    let nu = PI / angle;
    let eta = cosh.max(1.0).acosh();
    let phi = [PI + one - other, PI - one + other, PI + one + other, PI - one - other];
    phi.iter().map(|phi| (nu * phi).sin() / ((nu * eta).cosh() - (nu * phi).cos())).sum()
}

/// 1 near the shortest way, smoothly 0 at the reach.
fn fade(z: f64) -> f64 {
    let beyond = ((z.abs() / REACH - (1.0 - FADE)) / FADE).clamp(0.0, 1.0);
    (0.5 * PI * beyond).cos().powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exchange_of_source_and_receiver_changes_nothing() {
        for joints in [[0.0, 0.0], [1.2, 2.0]] {
            let (source, receiver) = ((3.0, 4.0, 0.0), (2.0, 3.5, 1.0));
            let there = DoubleEdge { angles: [4.7, 5.0], joints, source, receiver, width: 1.0 };
            let angles = [5.0, 4.7];
            let joints = [joints[1], joints[0]];
            let back = DoubleEdge { angles, joints, source: receiver, receiver: source, width: 1.0 };
            let (a, b) = (there.pressure(1.0), back.pressure(1.0));
            assert!((a.0 - b.0).hypot(a.1 - b.1) < 1e-9 * a.0.hypot(a.1));
        }
    }
}
