//! A finite edge of a rigid wedge: the secondary sources along it added up one by one.
//!
//! H(k) = −(ν/4π) ∫ Σ sin νφ_i / (cosh νη − cos νφ_i) e^(−jk(m + l))/(m l) dz over the real edge, with
//! cosh η = (m l + (z − z_S)(z − z_R))/(r_S r_R): slow, and not to be used within half a degree of a boundary, where the
//! secondary sources near the shortest way grow without bound. Only the diffracted field: what is lit has to be added.
//!
//! Reference: [Svensson1999] (docs/references.md).

use std::f64::consts::PI;

use crate::quadrature::integrate;

/// Radians of the phase that a panel of eight nodes takes at most.
const PANEL: f64 = 1.5;
/// Panels are no longer than this share of the shorter radius, where the sources change as fast as anywhere.
const SHARE: f64 = 0.02;

/// A wedge, a source and a receiver.
#[derive(Debug, Clone, Copy)]
pub struct WedgeEdge {
    /// Angle of the air [rad].
    pub angle: f64,
    /// From where to where along the edge [m].
    pub edge: (f64, f64),
    /// (radius [m], angle from the first face [rad], along the edge [m]) of the source.
    pub source: (f64, f64, f64),
    /// The same of the receiver.
    pub receiver: (f64, f64, f64),
}

impl WedgeEdge {
    /// Diffracted pressure (re, im) of a source of free field e^(−jkr)/r at wave number `k` [1/m].
    #[must_use]
    pub fn pressure(&self, k: f64) -> (f64, f64) {
        let step = (PANEL / (2.0 * k)).min(SHARE * self.source.0.min(self.receiver.0));
        let panels = ((self.edge.1 - self.edge.0) / step).ceil();
        let width = (self.edge.1 - self.edge.0) / panels;
        let mut sum = (0.0, 0.0);
        for panel in 0..panels as usize {
            let low = self.edge.0 + panel as f64 * width;
            sum.0 += integrate(low, low + width, |z| self.strength(z) * (k * self.length(z)).cos());
            sum.1 -= integrate(low, low + width, |z| self.strength(z) * (k * self.length(z)).sin());
        }
        sum
    }

    /// |p|² over [f1, f2] Hz, the mean of `count` frequencies, of the diffracted field plus a free wave over `clear` [m] where
    /// there is one [1/m²].
    #[must_use]
    pub fn band_energy(
        &self,
        clear: Option<f64>,
        band: (f64, f64),
        speed_of_sound: f64,
        count: usize,
    ) -> f64 {
        super::mean_over_band(band, speed_of_sound, count, |k| {
            let (re, im) = self.pressure(k);
            match clear {
                Some(way) => (re + (k * way).cos() / way, im - (k * way).sin() / way),
                None => (re, im),
            }
        })
    }

    fn length(&self, z: f64) -> f64 {
        self.source.0.hypot(z - self.source.2) + self.receiver.0.hypot(z - self.receiver.2)
    }

    fn strength(&self, z: f64) -> f64 {
        let nu = PI / self.angle;
        let ((rs, ts, zs), (rr, tr, zr)) = (self.source, self.receiver);
        let (m, l) = (rs.hypot(z - zs), rr.hypot(z - zr));
        let eta = ((m * l + (z - zs) * (z - zr)) / (rs * rr)).max(1.0).acosh();
        let phi = [PI + tr - ts, PI - tr + ts, PI + tr + ts, PI - tr - ts];
        let beta: f64 = phi.iter().map(|phi| (nu * phi).sin() / ((nu * eta).cosh() - (nu * phi).cos())).sum();
        -nu / (4.0 * PI) * beta / (m * l)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known insertion losses of a 270° corner.
    #[test]
    fn a_corner_shades_as_known() {
        let degrees = PI / 180.0;
        let edge = WedgeEdge {
            angle: 1.5 * PI,
            edge: (-150.0, 150.0),
            source: (8.0, 30.0 * degrees, 0.0),
            receiver: (6.0, 235.0 * degrees, 2.0),
        };
        let distance = (64.0 + 36.0 - 96.0 * (205.0 * degrees).cos() + 4.0f64).sqrt();
        for (centre, loss) in [(125.0, 7.13), (500.0, 12.11)] {
            let band = (centre / 2f64.sqrt(), centre * 2f64.sqrt());
            let energy = edge.band_energy(None, band, 343.0, 24);
            let found = -10.0 * (energy * distance * distance).log10();
            assert!((found - loss).abs() < 0.03, "{centre} Hz: {found}");
        }
    }
}
