//! A line source beside a rigid cylinder of rectangular section, by boundary elements, independent of edge theories.
//!
//! Kirchhoff and Helmholtz's integral in the plane, e^(jωt), n out of the cylinder, constant pressure on each element:
//!
//!   ½ p(x) = p_0(x) + ∫ p(y) ∂G/∂n dS,  G = −(j/4) H₀⁽²⁾(kr),  ∂G/∂n = (jk/4) H₁⁽²⁾(kr) (y − x)·n/r.
//!
//! The source radiates as all points of a line do of which each has e^(−jkr)/r: p_0 = −jπ H₀⁽²⁾(kr). Not to be used where k is that
//! of a resonance within the section, as it would be if its walls were soft: below π over the shorter side there is none.
//!
//! Reference: [BornWolf1999] §8.3 for the integral (docs/references.md).

use std::f64::consts::PI;

use crate::quadrature::integrate;

/// Elements in a wavelength.
const ELEMENTS: f64 = 24.0;
/// A complex number, (re, im).
pub(super) type Number = (f64, f64);
type Point2 = [f64; 2];

/// A section between two corners [m].
#[derive(Debug, Clone, Copy)]
pub struct Section {
    /// The corner with the smaller coordinates.
    pub low: Point2,
    /// The other.
    pub high: Point2,
}

/// A straight piece of the outline: its ends, and the normal into the air.
struct LineElement {
    ends: [Point2; 2],
    normal: Point2,
}

impl Section {
    /// Pressure at `receiver` of a line source at `source` at wave number `k` [1/m].
    #[must_use]
    pub fn pressure(&self, source: Point2, receiver: Point2, k: f64) -> Number {
        let elements = self.elements(2.0 * PI / k / ELEMENTS);
        let middles: Vec<Point2> = elements.iter().map(|e| e.at(0.5)).collect();
        let matrix = middles.iter().enumerate().map(|(i, &at)| {
            let row = elements.iter().enumerate().map(|(j, element)| {
                // A straight element does not see itself.
                if i == j { (0.5, 0.0) } else { negative(element.seen_from(at, k)) }
            });
            row.collect::<Vec<Number>>()
        });
        let incident = middles.iter().map(|&at| free(source, at, k)).collect();
        let pressures = solve(matrix.collect(), incident);
        let scattered = elements.iter().zip(pressures).map(|(e, p)| product(e.seen_from(receiver, k), p));
        scattered.fold(free(source, receiver, k), |a, b| (a.0 + b.0, a.1 + b.1))
    }

    fn elements(&self, length: f64) -> Vec<LineElement> {
        let ([x0, y0], [x1, y1]) = (self.low, self.high);
        let sides = [
            ([x0, y0], [x1, y0], [0.0, -1.0]),
            ([x1, y0], [x1, y1], [1.0, 0.0]),
            ([x1, y1], [x0, y1], [0.0, 1.0]),
            ([x0, y1], [x0, y0], [-1.0, 0.0]),
        ];
        let mut elements = Vec::new();
        for (from, to, normal) in sides {
            let count = (distance(from, to) / length).ceil().max(4.0) as usize;
            let at = |share: usize| between(from, to, share as f64 / count as f64);
            elements.extend((0..count).map(|i| LineElement { ends: [at(i), at(i + 1)], normal }));
        }
        elements
    }
}

impl LineElement {
    fn at(&self, share: f64) -> Point2 {
        between(self.ends[0], self.ends[1], share)
    }

    /// ∫ ∂G/∂n over the element.
    fn seen_from(&self, from: Point2, k: f64) -> Number {
        let height =
            (self.ends[0][0] - from[0]) * self.normal[0] + (self.ends[0][1] - from[1]) * self.normal[1];
        let length = distance(self.ends[0], self.ends[1]);
        let part = |bessel: fn(f64) -> f64| {
            integrate(0.0, 1.0, |share| {
                let r = distance(from, self.at(share));
                0.25 * k * bessel(k * r) * height / r * length
            })
        };
        // j (J − jY)
        (part(libm::y1), part(libm::j1))
    }
}

/// −jπ H₀⁽²⁾(kr).
fn free(from: Point2, to: Point2, k: f64) -> Number {
    let x = k * distance(from, to);
    (-PI * libm::y0(x), -PI * libm::j0(x))
}

fn distance(a: Point2, b: Point2) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn between(a: Point2, b: Point2, share: f64) -> Point2 {
    [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
}

fn negative((re, im): Number) -> Number {
    (-re, -im)
}

pub(super) fn product(a: Number, b: Number) -> Number {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

fn quotient(a: Number, b: Number) -> Number {
    let square = b.0 * b.0 + b.1 * b.1;
    product(a, (b.0 / square, -b.1 / square))
}

/// Solves `matrix` x = `right` by elimination; the pivots are the diagonal, which has to be large.
pub(super) fn solve(mut matrix: Vec<Vec<Number>>, mut right: Vec<Number>) -> Vec<Number> {
    let size = right.len();
    for column in 0..size {
        for row in column + 1..size {
            let factor = quotient(matrix[row][column], matrix[column][column]);
            let (above, below) = matrix.split_at_mut(row);
            for (value, pivot) in below[0][column..].iter_mut().zip(&above[column][column..]) {
                let taken = product(factor, *pivot);
                *value = (value.0 - taken.0, value.1 - taken.1);
            }
            let taken = product(factor, right[column]);
            right[row] = (right[row].0 - taken.0, right[row].1 - taken.1);
        }
    }
    for row in (0..size).rev() {
        let known = (row + 1..size).map(|column| product(matrix[row][column], right[column]));
        let rest = known.fold(right[row], |a, b| (a.0 - b.0, a.1 - b.1));
        right[row] = quotient(rest, matrix[row][row]);
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECTION: Section = Section { low: [-0.25, -6.0], high: [0.25, 0.0] };

    #[test]
    fn exchange_of_source_and_receiver_changes_nothing() {
        let (a, b) = ([-3.0, -1.0], [4.0, 0.5]);
        let (there, back) = (SECTION.pressure(a, b, 2.0), SECTION.pressure(b, a, 2.0));
        assert!(
            (there.0 - back.0).hypot(there.1 - back.1) < 0.01 * there.0.hypot(there.1),
            "{there:?} {back:?}"
        );
    }

    /// A wide wall before the receiver reflects as a mirror, and a thread across the way is not there.
    #[test]
    #[ignore = "long: cargo xtask accept"]
    fn walls_reflect_and_threads_do_nothing() {
        let wall = Section { low: [-40.0, -0.5], high: [40.0, 0.0] };
        let (source, receiver) = ([0.0, 3.0], [0.5, 1.0]);
        let (found, direct) = (wall.pressure(source, receiver, 2.0), free(source, receiver, 2.0));
        let image = free([0.0, -3.0], receiver, 2.0);
        let (re, im) = (found.0 - direct.0 - image.0, found.1 - direct.1 - image.1);
        assert!(re.hypot(im) < 0.05 * image.0.hypot(image.1), "{re} {im}");
        let thread = Section { low: [-0.01, -0.01], high: [0.01, 0.01] };
        let (found, direct) =
            (thread.pressure([-3.0, 0.0], [3.0, 0.1], 2.0), free([-3.0, 0.0], [3.0, 0.1], 2.0));
        assert!((found.0 - direct.0).hypot(found.1 - direct.1) < 0.01 * direct.0.hypot(direct.1));
    }
}
