//! A rigid half plane of any thickness, source and receiver far away in its shadow: multiple diffraction over its two edges.
//!
//! Far from both edges every line of secondary sources has one variable, η with a cosh η the way between two places on the edges, and what
//! goes n times over the top is
//!
//!   G_n = ½ⁿ⁻¹ (−ν/4π)ⁿ ∫ … ∫ B(η₁, θ_S) B(η₁ − η₂, 0) … B(η_{n−1}, θ_R) e^(−jka Σ cosh η) dη₁ … dη_{n−1},
//!
//! B the sum of the β of both edge's faces towards the top. The pressure is G √(2π/(jk r_S r_R (r_S + r_R))) e^(−jk(r_S + r_R)). Along the path
//! η = x − j gd x the exponential falls and does not oscillate.
//!
//! Reference: [Svensson1999] (docs/references.md), all distances but a long.

use std::f64::consts::PI;

use super::boundary_elements::{Number, product};

/// π over the angle of the air at both edges.
const INDEX: f64 = 2.0 / 3.0;
/// Step of x along the path.
const STEP: f64 = 0.05;
/// Where e^(−ka (…)) is spent.
const SPENT: f64 = 36.0;

/// A plate, both edges at right angles.
#[derive(Debug, Clone, Copy)]
pub struct ThickPlate {
    /// Wave number times thickness [1].
    pub ka: f64,
    /// Angles of the source and of the receiver from the top, each about its edge, beyond π [rad].
    pub angles: [f64; 2],
}

impl ThickPlate {
    /// What goes over 2, 4, … edges, as many `terms`: (re, im) of G.
    #[must_use]
    pub fn directivities(&self, terms: usize) -> Vec<Number> {
        let path = self.path();
        let [source, receiver] = self.angles.map(|angle| {
            let sent = path.iter().map(|&(eta, _)| sources(eta, angle));
            sent.collect::<Vec<Number>>()
        });
        let weighted = |of: &[Number]| -> Vec<Number> {
            of.iter().zip(&path).map(|(&of, &(_, weight))| product(of, weight)).collect()
        };
        let edge = -INDEX / (4.0 * PI);
        let back = |of: &[Number]| -> Vec<Number> {
            let of = weighted(of);
            let at = |&(eta, _): &(Number, Number)| {
                let between = path.iter().map(|&(other, _)| sources((eta.0 - other.0, eta.1 - other.1), 0.0));
                scaled(sum(between.zip(&of).map(|(a, &b)| product(a, b))), 0.5 * edge)
            };
            path.iter().map(at).collect()
        };
        let mut towards = receiver;
        let mut found = Vec::with_capacity(terms);
        for _ in 0..terms {
            let over = sum(weighted(&towards).iter().zip(&source).map(|(&a, &b)| product(a, b)));
            found.push(scaled(over, 0.5 * edge * edge));
            towards = back(&back(&towards));
        }
        found
    }

    /// η and e^(−jka cosh η) dη.
    fn path(&self) -> Vec<(Number, Number)> {
        let end = (SPENT / self.ka + 1.0).asinh() + 1.0;
        let count = (end / STEP).ceil() as i32;
        let at = |i: i32| {
            let x = f64::from(i) * STEP;
            let decay = (-self.ka * x.sinh() * x.tanh()).exp() * STEP;
            let start = ((self.ka).cos() * decay, -(self.ka).sin() * decay);
            ((x, -(x.sinh()).atan()), product(start, (1.0, -1.0 / x.cosh())))
        };
        (-count..=count).map(at).collect()
    }
}

/// 2 Σ sin νφ/(cosh νη − cos νφ) over φ = π ± θ.
fn sources(eta: Number, theta: f64) -> Number {
    let (re, im) = (INDEX * eta.0, INDEX * eta.1);
    let cosh = (re.cosh() * im.cos(), re.sinh() * im.sin());
    sum([PI + theta, PI - theta].into_iter().map(|phi| {
        let (below, sine) = ((cosh.0 - (INDEX * phi).cos(), cosh.1), 2.0 * (INDEX * phi).sin());
        let square = below.0 * below.0 + below.1 * below.1;
        (sine * below.0 / square, -sine * below.1 / square)
    }))
}

fn sum(of: impl Iterator<Item = Number>) -> Number {
    of.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
}

fn scaled((re, im): Number, by: f64) -> Number {
    (re * by, im * by)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// −(ν/4π) Σβ at η = 0 of a sheet's rim.
    fn of_a_sheet(angles: [f64; 2]) -> f64 {
        // From the face that looks to the source.
        let (source, receiver) = (1.5 * PI - angles[0], 0.5 * PI + angles[1]);
        let sums = [receiver - source, receiver + source];
        let phi = [PI + sums[0], PI - sums[0], PI + sums[1], PI - sums[1]];
        -phi.iter().map(|phi| (0.5 * phi).sin() / (1.0 - (0.5 * phi).cos())).sum::<f64>() / (8.0 * PI)
    }

    /// Two edges alone are half a decibel off, as is half of what goes over the top once.
    #[test]
    fn a_plate_of_no_thickness_is_a_sheet() {
        for angles in [[4.0, 4.0], [3.7, 4.4], [4.5, 4.2]] {
            let found = ThickPlate { ka: 0.003, angles }.directivities(4);
            let level = |count: usize| {
                let (re, im) = sum(found[..count].iter().copied());
                20.0 * (re.hypot(im) / of_a_sheet(angles).abs()).log10()
            };
            assert!(level(4).abs() < 0.1 && level(1) < -0.3, "{angles:?}: {} {}", level(4), level(1));
        }
    }

    #[test]
    fn exchange_of_source_and_receiver_changes_nothing() {
        let over = |angles| ThickPlate { ka: 0.7, angles }.directivities(2);
        for (there, back) in over([3.5, 4.4]).into_iter().zip(over([4.4, 3.5])) {
            assert!((there.0 - back.0).hypot(there.1 - back.1) < 1e-12);
        }
    }
}
