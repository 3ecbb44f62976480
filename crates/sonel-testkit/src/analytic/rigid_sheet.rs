//! A point source beside a thin rigid rectangle, by boundary elements, independent of edge theories.
//!
//! The pressure jumps by μ across the sheet, and its normal derivative vanishes there, e^(jωt), G = e^(−jkr)/(4πr):
//!
//!   p(x) = p_0(x) + ∫ μ ∂G/∂n dS,  −∂p_0/∂n = ∫ μ (∇² + k²) G dS on the sheet, in the sense of its finite part,
//!
//! since ∂²G/∂n² = −(∇² + k²) G with the derivatives in the plane. For μ constant on an element its integral is one around the
//! element's rim, for r (∇² + k²) e^(−jkr)/r has the antiderivative −e^(−jkr)/r:
//!
//!   ∫ (∇² + k²) G dS = −(1/4π) (∮ e^(−jkr)/r dθ + 2πjk), the latter for the element around x alone.
//!
//! Elements are as wide as those of a circle's shadow, narrow at the rims, where μ falls as a root; places are collocated.
//! About 1 % of the scattered pressure with sixteen elements across.
//!
//! Reference: [BornWolf1999] §8.3 for the integral (docs/references.md).

use std::f64::consts::PI;

use super::boundary_elements::{Number, product, solve};
use crate::quadrature::{integrate, integrate_rectangle};

/// A rectangle in the plane x = 0.
#[derive(Debug, Clone, Copy)]
pub struct RigidSheet {
    /// From where to where it reaches along y and along z [m].
    pub sides: [[f64; 2]; 2],
    /// Elements along y and along z.
    pub elements: [usize; 2],
}

/// What a source at a wave number makes of a sheet.
#[derive(Debug, Clone)]
pub struct ScatteredBySheet {
    elements: Vec<SheetElement>,
    /// μ of every element [1/m].
    jumps: Vec<Number>,
    k: f64,
}

#[derive(Debug, Clone, Copy)]
struct SheetElement {
    low: [f64; 2],
    high: [f64; 2],
    /// Where the condition is held.
    collocated: [f64; 2],
}

impl RigidSheet {
    /// The field that the sheet adds to that of a source of free field e^(−jkr)/r at `source` [m], at wave number `k` [1/m].
    #[must_use]
    pub fn scattered(&self, source: [f64; 3], k: f64) -> ScatteredBySheet {
        let elements = self.elements();
        let places: Vec<[f64; 2]> = elements.iter().map(|e| e.collocated).collect();
        let row = |(i, &at): (usize, &[f64; 2])| {
            let own = |j| if i == j { 0.5 * k } else { 0.0 };
            elements.iter().enumerate().map(|(j, e)| e.around(at, k, own(j))).collect::<Vec<Number>>()
        };
        let matrix = places.iter().enumerate().map(row).collect();
        let slope = |&[y, z]: &[f64; 2]| {
            let r = (source[0].powi(2) + (source[1] - y).powi(2) + (source[2] - z).powi(2)).sqrt();
            // −∂/∂x of e^(−jkr)/r, at x = 0.
            let factor = -source[0] / (r * r);
            product((factor / r, factor * k), ((k * r).cos(), -(k * r).sin()))
        };
        let jumps = solve(matrix, places.iter().map(slope).collect());
        ScatteredBySheet { elements, jumps, k }
    }

    fn elements(&self) -> Vec<SheetElement> {
        let borders = |side: usize| {
            let ([low, high], count) = (self.sides[side], self.elements[side]);
            let at = move |share: f64| low + 0.5 * (high - low) * (1.0 - (PI * share / count as f64).cos());
            (0..count).map(|i| i as f64).map(move |i| [at(i), at(i + 0.5), at(i + 1.0)])
        };
        let element = |y: [f64; 3], z: [f64; 3]| SheetElement {
            low: [y[0], z[0]],
            collocated: [y[1], z[1]],
            high: [y[2], z[2]],
        };
        borders(0).flat_map(|y| borders(1).map(move |z| element(y, z))).collect()
    }
}

impl ScatteredBySheet {
    /// Pressure (re, im) at `receiver` [m], without that of the free field.
    #[must_use]
    pub fn pressure(&self, receiver: [f64; 3]) -> Number {
        let parts = self
            .elements
            .iter()
            .zip(&self.jumps)
            .map(|(e, &jump)| product(e.seen_from(receiver, self.k), jump));
        parts.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
    }
}

impl SheetElement {
    /// −(1/4π) ∮ e^(−jkr)/r dθ about `at`, less j `own`.
    fn around(&self, at: [f64; 2], k: f64, own: f64) -> Number {
        let [y, z] = at;
        let sides = [
            (self.high[0] - y, self.low[1] - z, self.high[1] - z),
            (y - self.low[0], z - self.high[1], z - self.low[1]),
            (self.high[1] - z, y - self.high[0], y - self.low[0]),
            (z - self.low[1], self.low[0] - y, self.high[0] - y),
        ];
        let mut sum = (0.0, -own);
        for (away, from, to) in sides {
            // On a side at the signed distance `away` r is away/cos θ.
            let (from, to) = ((from / away.abs()).atan(), (to / away.abs()).atan());
            let part = |turn: fn(f64) -> f64| {
                integrate(from, to, |theta| turn(k * away.abs() / theta.cos()) * theta.cos()) / away
            };
            sum.0 -= part(f64::cos) / (4.0 * PI);
            sum.1 += part(f64::sin) / (4.0 * PI);
        }
        sum
    }

    /// ∫ ∂G/∂n over the element.
    fn seen_from(&self, from: [f64; 3], k: f64) -> Number {
        let part = |value: fn(f64) -> f64| {
            integrate_rectangle(self.low, self.high, |[y, z]| {
                let r = (from[0].powi(2) + (from[1] - y).powi(2) + (from[2] - z).powi(2)).sqrt();
                value(k * r) / (r * r * r) * from[0] / (4.0 * PI)
            })
        };
        // (1 + jkr) e^(−jkr)
        (part(|x| x.cos() + x * x.sin()), part(|x| x * x.cos() - x.sin()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(width: f64, elements: [usize; 2]) -> RigidSheet {
        RigidSheet { sides: [[-0.5 * width, 0.5 * width], [-0.5, 0.5]], elements }
    }

    /// Where nothing oscillates the sheet is a dipole of known moment: the mass of water that a plate moves is C π/4 a² b,
    /// C = 0.579, 0.757 and 0.897 for b/a = 1, 2 and 5.
    #[test]
    fn a_small_sheet_is_the_dipole_of_a_plate_in_water() {
        for (width, expected) in [(1.0, 0.579), (2.0, 0.757), (5.0, 0.897)] {
            let (far, k) = (1e3, 1e-6);
            let (re, _) = sheet(width, [20, 20]).scattered([-far, 0.0, 0.0], k).pressure([far, 0.0, 0.0]);
            // p_0 falls by 1/far² per metre, and a jump of that times the moment radiates 1/(4π far²).
            let moment = -re * 4.0 * PI * far.powi(4);
            let found = moment / (0.25 * PI * width);
            assert!((found / expected - 1.0).abs() < 0.002, "{width}: {found}");
        }
    }

    #[test]
    fn exchange_of_source_and_receiver_changes_nothing() {
        let (a, b) = ([-1.0, 0.3, 0.2], [0.8, -1.0, 0.9]);
        let there = sheet(1.3, [14, 12]).scattered(a, 3.0).pressure(b);
        let back = sheet(1.3, [14, 12]).scattered(b, 3.0).pressure(a);
        let error = (there.0 - back.0).hypot(there.1 - back.1) / there.0.hypot(there.1);
        assert!(error < 1e-3, "{error}");
    }

    /// Near the middle of a sheet of several wavelengths there is a mirror on one side and silence on the other.
    #[test]
    fn a_wide_sheet_is_a_mirror_and_a_shade() {
        let scattered = sheet(1.0, [24, 24]).scattered([-0.1, 0.0, 0.0], 40.0);
        let of_the_free_field = |x: f64, way: f64| {
            let (re, im) = scattered.pressure([x, 0.0, 0.0]);
            product((re, im), ((40.0 * way).cos() * way, (40.0 * way).sin() * way))
        };
        for (x, expected) in [(-0.1, 1.0), (0.1, -1.0)] {
            let (re, im) = of_the_free_field(x, 0.2);
            assert!((re - expected).abs() < 0.15 && im.abs() < 0.15, "{x}: {re} {im}");
        }
    }
}
