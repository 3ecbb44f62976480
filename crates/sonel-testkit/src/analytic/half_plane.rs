//! A point source beside a rigid half plane: Macdonald's solution, by plain quadrature.
//!
//! With D the length of the shortest way over the edge and R that of a straight one (from the source, or from its image in
//! the plane), each of the two waves is
//!
//!   −jk ∫ H₁⁽²⁾(kR + s²)/√(s² + 2kR) ds from ∓√(k(D − R)) to ∞,
//!
//! the upper sign where the straight way is clear; over all s it is e^(−jkR)/R. Valid everywhere.
//!
//! References: [Macdonald1915] (docs/references.md); Bowman, Senior and Uslenghi (1969) section 8.3.

use crate::quadrature::integrate;

/// How far beyond the lower limit, or beyond 0, the integral goes by quadrature.
const REACH: f64 = 30.0;
/// Radians of s² that a panel of eight nodes takes.
const PANEL: f64 = 3.0;

/// Source and receiver beside a half plane, cylindrical about its edge. Angles run from one face through the air to 2π.
#[derive(Debug, Clone, Copy)]
pub struct HalfPlane {
    /// (radius [m], angle [rad], along the edge [m]) of the source.
    pub source: (f64, f64, f64),
    /// The same of the receiver.
    pub receiver: (f64, f64, f64),
}

impl HalfPlane {
    /// Pressure (re, im) of a source of free field e^(−jkr)/r at wave number `k` [1/m].
    #[must_use]
    pub fn pressure(&self, k: f64) -> (f64, f64) {
        let between = self.receiver.1 - self.source.1;
        let sum = self.receiver.1 + self.source.1;
        let (a, b) = (self.wave(k, between), self.wave(k, sum));
        (a.0 + b.0, a.1 + b.1)
    }

    /// |p|² over [f1, f2] Hz, the mean of `count` frequencies [1/m²].
    #[must_use]
    pub fn band_energy(&self, band: (f64, f64), speed_of_sound: f64, count: usize) -> f64 {
        super::mean_over_band(band, speed_of_sound, count, |k| self.pressure(k))
    }

    fn wave(&self, k: f64, turn: f64) -> (f64, f64) {
        let ((rs, _, zs), (rr, _, zr)) = (self.source, self.receiver);
        let straight = (rs * rs + rr * rr - 2.0 * rs * rr * turn.cos() + (zs - zr).powi(2)).sqrt();
        let detour = (rs + rr).hypot(zs - zr);
        // D² − R² = 2 r_S r_R (1 + cos turn).
        let half = (turn / 2.0).cos();
        let from = -half.signum() * (k * 4.0 * rs * rr * half * half / (detour + straight)).sqrt();
        let x = |s: f64| k * straight + s * s;
        let scale = |s: f64| k / (s * s + 2.0 * k * straight).sqrt();
        // −j (J − jY) = −Y − jJ
        let real = |s: f64| -libm::y1(x(s)) * scale(s);
        let imaginary = |s: f64| -libm::j1(x(s)) * scale(s);
        let to = from.max(0.0) + REACH;
        // What lies beyond turns as e^(−js²): by parts, its leading term is the integrand over 2js.
        let re = oscillating(from, to, real) + imaginary(to) / (2.0 * to);
        let im = oscillating(from, to, imaginary) - real(to) / (2.0 * to);
        (re, im)
    }
}

fn oscillating(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut sum) = (from, 0.0);
    while low < to {
        let high = (low + PANEL / (1.5 + 2.0 * low.abs())).min(to);
        sum += integrate(low, high, &f);
        low = high;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn far_from_the_screen_the_field_is_free() {
        let half_plane = HalfPlane { source: (200.0, 2.0, 0.0), receiver: (200.0, 2.01, 1.0) };
        let (re, im) = half_plane.wave(5.0, 0.01);
        let distance = (2.0 * 200.0 * (0.005f64).sin()).hypot(1.0);
        let (phase, level) = (5.0 * distance, 1.0 / distance);
        assert!((re - level * phase.cos()).abs() < 1e-4 * level, "{re}");
        assert!((im + level * phase.sin()).abs() < 1e-4 * level, "{im}");
    }

    #[test]
    fn on_the_shadow_boundary_half_of_the_wave_is_there() {
        let half_plane = HalfPlane { source: (3.0, 1.0, 0.0), receiver: (4.0, 1.0 + PI, 0.0) };
        let (re, im) = half_plane.wave(20.0, PI);
        assert!((re.hypot(im) * 7.0 - 0.5).abs() < 1e-4);
    }

    #[test]
    fn exchange_of_source_and_receiver_changes_nothing() {
        let (a, b) = ((3.0, 0.7, 0.2), (4.0, 5.0, 1.9));
        let there = HalfPlane { source: a, receiver: b }.pressure(9.0);
        let back = HalfPlane { source: b, receiver: a }.pressure(9.0);
        assert!((there.0 - back.0).hypot(there.1 - back.1) < 1e-12);
    }
}
