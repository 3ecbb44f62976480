//! A point source beside a rigid box, by boundary elements, independent of edge theories.
//!
//! Kirchhoff and Helmholtz's integral, e^(jωt), n out of the box, constant pressure on each element:
//!
//!   ½ p(x) = p_0(x) + ∫ p(y) ∂G/∂n dS,  G = e^(−jkr)/(4πr),  ∂G/∂n = (1 + jkr) e^(−jkr) (x − y)·n/(4πr³).
//!
//! Elements are narrow at the edges, where the pressure changes fastest. Not to be used where k is that of a resonance of the inside, as
//! it would be if its walls were soft: below π √(1/a² + 1/b² + 1/c²) there is none.
//!
//! Reference: [BornWolf1999] §8.3 for the integral (docs/references.md).

use std::f64::consts::PI;

use super::boundary_elements::{Number, product, solve};
use crate::quadrature::integrate_rectangle;
use crate::vector::distance;

type Point3 = [f64; 3];

/// A box with one corner in the origin and its edges along the positive axes.
#[derive(Debug, Clone, Copy)]
pub struct RigidBox {
    /// Its edges [m].
    pub size: Point3,
    /// Width of the elements [m], on average.
    pub elements: f64,
}

/// What a source at a wave number makes of a box.
#[derive(Debug, Clone)]
pub struct ScatteredByBox {
    elements: Vec<BoxElement>,
    /// Pressure on every element [1/m].
    pressures: Vec<Number>,
    k: f64,
}

#[derive(Debug, Clone, Copy)]
struct BoxElement {
    /// The axis that its normal is on, where on that it is, and the normal's sign.
    axis: usize,
    at: f64,
    sign: f64,
    /// Its corners on the axes that follow.
    low: [f64; 2],
    high: [f64; 2],
}

impl RigidBox {
    /// The field that the box adds to that of a source of free field e^(−jkr)/r at `source` [m], at wave number `k` [1/m].
    #[must_use]
    pub fn scattered(&self, source: Point3, k: f64) -> ScatteredByBox {
        let elements = self.elements();
        let row = |(i, of): (usize, &BoxElement)| {
            let at = of.place([0, 1].map(|side| 0.5 * (of.low[side] + of.high[side])));
            let seen = elements.iter().enumerate().map(|(j, element)| {
                // A plane does not see itself.
                let (re, im) = element.seen_from(at, k);
                if i == j { (0.5, 0.0) } else { (-re, -im) }
            });
            let r = distance(source, at);
            (seen.collect::<Vec<Number>>(), ((k * r).cos() / r, -(k * r).sin() / r))
        };
        let (matrix, incident) = elements.iter().enumerate().map(row).unzip();
        let pressures = solve(matrix, incident);
        ScatteredByBox { elements, pressures, k }
    }

    fn elements(&self) -> Vec<BoxElement> {
        let mut elements = Vec::new();
        for axis in 0..3 {
            let [y, z] = [1, 2].map(|next| self.borders((axis + next) % 3));
            for (at, sign) in [(0.0, -1.0), (self.size[axis], 1.0)] {
                for y in y.windows(2) {
                    let sides = z.windows(2).map(|z| ([y[0], z[0]], [y[1], z[1]]));
                    elements.extend(sides.map(|(low, high)| BoxElement { axis, at, sign, low, high }));
                }
            }
        }
        elements
    }

    /// Borders of the elements along an axis: the shadows of equal arcs.
    fn borders(&self, axis: usize) -> Vec<f64> {
        let count = (self.size[axis] / self.elements).ceil();
        let at = |i: usize| 0.5 * self.size[axis] * (1.0 - (PI * i as f64 / count).cos());
        (0..=count as usize).map(at).collect()
    }
}

impl ScatteredByBox {
    /// Pressure (re, im) at `receiver` [m], without that of the free field.
    #[must_use]
    pub fn pressure(&self, receiver: Point3) -> Number {
        let parts = self.elements.iter().zip(&self.pressures);
        parts.fold((0.0, 0.0), |sum, (element, &pressure)| {
            let (re, im) = product(element.seen_from(receiver, self.k), pressure);
            (sum.0 + re, sum.1 + im)
        })
    }
}

impl BoxElement {
    fn place(&self, [y, z]: [f64; 2]) -> Point3 {
        let mut place = [0.0; 3];
        (place[self.axis], place[(self.axis + 1) % 3], place[(self.axis + 2) % 3]) = (self.at, y, z);
        place
    }

    /// ∫ ∂G/∂n over the element.
    fn seen_from(&self, from: Point3, k: f64) -> Number {
        let height = self.sign * (from[self.axis] - self.at);
        let part = |value: fn(f64) -> f64| {
            integrate_rectangle(self.low, self.high, |at| {
                let r = distance(from, self.place(at));
                value(k * r) * height / (4.0 * PI * r * r * r)
            })
        };
        // (1 + jkr) e^(−jkr)
        (part(|x| x.cos() + x * x.sin()), part(|x| x * x.cos() - x.sin()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[ignore = "long: cargo xtask accept"]
    fn exchange_of_source_and_receiver_changes_nothing() {
        let rigid = RigidBox { size: [2.0, 1.0, 0.75], elements: 0.15 };
        let (a, b) = ([-1.0, 0.3, 1.2], [2.8, -1.0, 0.9]);
        let (there, back) = (rigid.scattered(a, 3.0).pressure(b), rigid.scattered(b, 3.0).pressure(a));
        let error = (there.0 - back.0).hypot(there.1 - back.1) / there.0.hypot(there.1);
        assert!(error < 0.03, "{there:?} {back:?}");
    }

    /// Where nothing oscillates a cube is a dipole of 1.64 V: V for what it displaces of a flow about it, 0.64 V for what it moves.
    #[test]
    #[ignore = "long: cargo xtask accept"]
    fn a_small_cube_is_a_dipole_of_known_strength() {
        let (far, k) = (1e3, 1e-6);
        let rigid = RigidBox { size: [1.0; 3], elements: 0.1 };
        let (re, _) = rigid.scattered([-far, 0.5, 0.5], k).pressure([far, 0.5, 0.5]);
        let found = -re * 4.0 * PI * far.powi(4);
        assert!((found / 1.640 - 1.0).abs() < 0.02, "{found}");
    }
}
