//! Second order: source, two parallel edges joined by a plane face, receiver, as over the top of a thick barrier.
//!
//! The secondary sources of the first edge light the second along the face, where the incident wave is half of what is heard:
//!
//!   H₂(k) = ½ (ν₁ν₂/16π²) ∫∫ Σβ₁ Σβ₂ e^(−jk(m₁+m₂+m₃))/(m₁ m₂ m₃) dz₁ dz₂.
//!
//! Both integrals are taken along paths of steepest descent as in [`crate::edge_path`]: the outer one as if the second edge
//! did not bend the way, the inner one for every (complex) point of the first edge. With u and t along them the exponential is
//! e^(−jk L_0) e^(−k(u² + t²)). Edges count as infinite here; what their ends leave is for [`crate::face`] to say. Sound that runs back and forth between the edges is of higher order and left out: 0.4 dB
//! where they are much nearer to one another than the wavelength, less beyond (docs/diffraction.md).
//!
//! Reference: [Svensson1999] (docs/references.md).

use std::f64::consts::PI;

use crate::complex::Complex;
use crate::contour::{SIX, nodes};
use crate::wave_numbers::WaveNumbers;
use crate::wedge::{Wedge, WedgePoint, index};

/// A path over two parallel edges.
#[derive(Debug, Clone)]
pub struct DoublePath {
    length: f64,
    /// u² [m] of every outer node.
    outer: Vec<f64>,
    /// t² [m] of every inner node.
    inner: Vec<f64>,
    /// Integrand with weights, `[outer][inner]` [1/m].
    values: Vec<Complex>,
}

/// An edge as seen from the source or the receiver beyond it.
#[derive(Debug, Clone, Copy)]
pub struct Side<'a> {
    /// The edge.
    pub wedge: &'a Wedge,
    /// The source or receiver about it.
    pub point: WedgePoint,
    /// Whether the face that joins the edges is its second one.
    pub joined_at_second: bool,
}

impl Side<'_> {
    fn joint(&self) -> f64 {
        if self.joined_at_second { self.wedge.angle() } else { 0.0 }
    }

    /// ½ν(φ_i) less the nearest multiple of π, of the four terms towards the face that joins the edges.
    fn halves(&self) -> [f64; 4] {
        let (to, from) = (self.joint(), self.point.angle);
        [PI + to - from, PI - to + from, PI + to + from, PI - to - from].map(|turn| {
            let half = 0.5 * index(self.wedge.angle()) * turn;
            let half = half - PI * libm::round(half / PI);
            if half < 0.0 { half.min(-BOUNDARY) } else { half.max(BOUNDARY) }
        })
    }
}

/// Nearest that source and receiver come to the line of their edge, relative to the length of the way.
const NEAREST: f64 = 1e-9;
/// Nearest that a way comes to a boundary [rad].
const BOUNDARY: f64 = 1e-9;

/// Σ β of an edge at ½η.
fn strength(halves: &[f64; 4], nu: f64, half_eta: Complex) -> Complex {
    let sine = (half_eta * nu).hyperbolic_sine();
    let square = sine * sine;
    halves.iter().fold(Complex::ZERO, |sum, &half| {
        let (sine, cosine) = libm::sincos(half);
        sum + Complex::real(sine * cosine) / (square + Complex::real(sine * sine))
    })
}

/// arsinh(z/r) of a way m with m² = z² + r²: ln((m + z)/r), without the difference of nearly equal numbers.
fn rapidity(way: Complex, along: Complex, radius: f64) -> Complex {
    if along.re < 0.0 {
        -((way - along) * (1.0 / radius)).logarithm()
    } else {
        ((way + along) * (1.0 / radius)).logarithm()
    }
}

/// A node of a path over an edge between points at `near` and `far` [m] from its line: the variable's measure dη/L and where it is.
struct Node {
    measure: Complex,
    /// sinh ½η.
    sine: Complex,
}

fn node(t: f64, weight: f64, length: Complex, near: f64, far: f64) -> Node {
    let per_square = (Complex::new(0.0, -2.0) * length - Complex::real(t * t)) * (0.25 / (near * far));
    let root = per_square.sqrt();
    let sine = root * t;
    let cosine = (Complex::real(1.0) + sine * sine).sqrt();
    Node { measure: Complex::new(0.0, -weight / (near * far)) / (root * cosine), sine }
}

/// Where the way of `length` at η crosses the edge: the way from the near point there, and how far along that is.
fn crossing(sine: Complex, length: Complex, near: f64, far: f64, offset: Complex) -> (Complex, Complex) {
    let cosine = (Complex::real(1.0) + sine * sine).sqrt();
    let x = Complex::real(near) + (Complex::real(1.0) + sine * sine * 2.0) * far;
    let y = sine * cosine * (2.0 * far);
    // x² − y², without the difference of large numbers.
    let square = Complex::real((near + far) * (near + far)) + sine * sine * (4.0 * near * far);
    ((x * length + y * offset) * near / square, (y * length + x * offset) * near / square)
}

/// √(L − L′) of the nearest singularity beside the shortest way.
fn scale(halves: &[f64; 4], nu: f64, near: f64, far: f64, length: f64) -> f64 {
    let nearest = halves.iter().map(|half| (half.abs() / nu).min(0.5 * PI)).fold(0.5 * PI, f64::min);
    let sine = libm::sin(nearest);
    (4.0 * near * far * sine * sine / (2.0 * length)).sqrt()
}

impl DoublePath {
    /// The path from the `source`'s edge to the `receiver`'s, which is parallel to it at a distance of `width` [m], for wave
    /// numbers of at least `smallest_k` [1/m]. `offset` is how far along the edges the receiver is from the source [m], in the
    /// direction of the source's edge.
    #[must_use]
    pub fn new(source: Side<'_>, receiver: Side<'_>, width: f64, offset: f64, smallest_k: f64) -> Self {
        // The inner path stays clear of the poles of its own edge however far the outer one runs, and of those alone: the
        // edge whose boundary is nearer is the inner one.
        let closeness = |side: Side<'_>| side.halves().iter().map(|half| half.abs()).fold(PI, f64::min);
        if closeness(source) < closeness(receiver) {
            return Self::inwards(receiver, source, width, back(source, receiver, offset), smallest_k);
        }
        Self::inwards(source, receiver, width, offset, smallest_k)
    }

    /// The same with the inner path over the receiver's edge.
    fn inwards(source: Side<'_>, receiver: Side<'_>, width: f64, offset: f64, smallest_k: f64) -> Self {
        let nearest = NEAREST * (source.point.radius + receiver.point.radius + width + offset.abs());
        let (first, last) = (source.point.radius.max(nearest), receiver.point.radius.max(nearest));
        let beyond = width + last;
        let length = libm::hypot(first + beyond, offset);
        let (of_source, of_receiver) = (source.halves(), receiver.halves());
        let (nu, next_nu) = (index(source.wedge.angle()), index(receiver.wedge.angle()));
        let outer = nodes(smallest_k, scale(&of_source, nu, first, beyond, length), SIX);
        let inner = nodes(smallest_k, scale(&of_receiver, next_nu, width, last, length), SIX);
        let factor = 0.5 * nu * next_nu / (16.0 * PI * PI);
        let mut values = vec![Complex::ZERO; outer.len() * inner.len()];
        for (row, &(u, weight)) in values.chunks_exact_mut(inner.len()).zip(&outer) {
            let way = Complex::new(length, -u * u);
            let start = node(u, weight, Complex::real(length), first, beyond);
            for turn in [1.0, -1.0] {
                let (m, z) = crossing(start.sine * turn, way, first, beyond, Complex::real(offset));
                let rest = way - m;
                let measure = rest * start.measure * factor;
                let left = Complex::real(offset) - z;
                for (value, &(t, weight)) in row.iter_mut().zip(&inner) {
                    let second = node(t, weight, rest, width, last);
                    let beta = strength(&of_receiver, next_nu, second.sine.inverse_hyperbolic_sine());
                    let remaining = rest - Complex::real(t * t) * Complex::new(0.0, 1.0);
                    for turn in [1.0, -1.0] {
                        let (m2, dz) = crossing(second.sine * turn, remaining, width, last, left);
                        // η about the first edge between its source and the point on the second, each part on its own
                        // branch: cosh η alone would not tell beyond ±jπ.
                        let eta = rapidity(m, z, first) + rapidity(m2, -dz, width);
                        *value += measure * second.measure * beta * strength(&of_source, nu, eta * 0.5);
                    }
                }
            }
        }
        let square = |nodes: Vec<(f64, f64)>| nodes.into_iter().map(|(t, _)| t * t).collect();
        let (outer, inner) = (square(outer), square(inner));
        Self { length, outer, inner, values }
    }

    /// Length of the shortest way over both edges [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Amplitudes at every wave number, to be multiplied by e^(−jk length) [1/m].
    #[must_use]
    pub fn amplitudes(&self, numbers: &WaveNumbers) -> Vec<Complex> {
        let count = numbers.values().len();
        let decays = |nodes: &[f64]| {
            let mut decays = vec![0.0; nodes.len() * count];
            for (decays, p) in decays.chunks_exact_mut(count).zip(nodes) {
                numbers.decay(*p, decays);
            }
            decays
        };
        let (outer, inner) = (decays(&self.outer), decays(&self.inner));
        let mut sums = vec![Complex::ZERO; count];
        for (values, outer) in self.values.chunks_exact(self.inner.len()).zip(outer.chunks_exact(count)) {
            for (value, inner) in values.iter().zip(inner.chunks_exact(count)) {
                for ((sum, outer), inner) in sums.iter_mut().zip(outer).zip(inner) {
                    *sum += *value * (outer * inner);
                }
            }
        }
        sums
    }

    /// Amplitude at one wave number `k` [1/m].
    #[must_use]
    pub fn amplitude(&self, k: f64) -> Complex {
        self.amplitudes(&k.into())[0]
    }
}

/// How far along the receiver's edge the source is from the receiver [m], whichever way that edge runs.
fn back(source: Side<'_>, receiver: Side<'_>, offset: f64) -> f64 {
    if source.wedge.direction().dot(receiver.wedge.direction()) < 0.0 { offset } else { -offset }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge_path::{EdgePath, Lit};
    use glam::DVec3;

    const WIDTH: f64 = 1.5;

    fn wedge() -> Wedge {
        Wedge::new([-DVec3::Z * 1e4, DVec3::Z * 1e4], DVec3::X, DVec3::Y, 1.5 * PI).unwrap()
    }

    /// Over a barrier of square section: the top is the first face of both edges.
    fn path(source: (f64, f64), receiver: (f64, f64), width: f64, offset: f64) -> DoublePath {
        let wedge = wedge();
        let side = |(radius, angle): (f64, f64), along| Side {
            wedge: &wedge,
            point: WedgePoint { radius, angle, along },
            joined_at_second: false,
        };
        DoublePath::new(side(source, 1e4), side(receiver, 1e4 + offset), width, offset, 1.0)
    }

    /// Against both lines of secondary sources added up, point by point.
    #[test]
    fn two_edges_are_the_sum_of_their_parts() {
        for (source, receiver, offset) in [
            ((4.0, 4.2), (3.0, 4.4), 1.0),
            ((2.0, 3.4), (5.0, 3.9), 0.0),
            ((2.0, 2.8), (3.0, 2.0), 0.4),
            ((2.0, 4.5), (3.0, 2.8), 0.4),
        ] {
            for k in [2.0, 6.0] {
                let found = path(source, receiver, WIDTH, offset).amplitude(k)
                    * Complex::unit(-k * path(source, receiver, WIDTH, offset).length());
                let parts = sonel_testkit::analytic::double_edge::DoubleEdge {
                    angles: [1.5 * PI; 2],
                    joints: [0.0; 2],
                    source: (source.0, source.1, 0.0),
                    receiver: (receiver.0, receiver.1, offset),
                    width: WIDTH,
                };
                let (re, im) = parts.pressure(k);
                let error = (found - Complex::new(re, im)).modulus() / found.modulus();
                assert!(error < 0.01, "k {k}: {error}, {found:?} {re} {im}");
            }
        }
    }

    /// Against boundary elements, which know of no edge: a line source behind a rigid slab 8 m high, over its top and under its
    /// foot. A line source hears √(2πL/(jk)) of what a point source does. What is left out runs along a side from the top to the foot.
    #[test]
    fn a_slab_shades_as_boundary_elements_say() {
        use sonel_testkit::analytic::boundary_elements::Section;
        const HEIGHT: f64 = 8.0;
        // Below the resonances of the section.
        for (width, k) in [(0.5, 2.0), (0.5, 5.0), (1.5, 1.9)] {
            for (source, receiver) in [([3.0, 1.5], [4.0, 2.0]), ([2.0, 2.5], [5.0, 0.5])] {
                // [beside, below] from the upper edge; from the lower one the other way up.
                let about =
                    |[beside, below]: [f64; 2]| (beside.hypot(below), PI + libm::atan2(below, beside));
                let turned = |[beside, below]: [f64; 2]| about([beside, HEIGHT - below]);
                let over = [
                    path(about(source), about(receiver), width, 0.0),
                    path(turned(source), turned(receiver), width, 0.0),
                ];
                let line = |path: &DoublePath, share: f64| {
                    let spread = (2.0 * PI * path.length() / k).sqrt() * share;
                    path.amplitude(k) * Complex::unit(-k * path.length() - 0.25 * PI) * spread
                };
                let section = Section { low: [0.0, -HEIGHT], high: [width, 0.0] };
                let (re, im) =
                    section.pressure([-source[0], -source[1]], [width + receiver[0], -receiver[1]], k);
                let exact = Complex::new(re, im);
                let error = |share: f64| {
                    (line(&over[0], share) + line(&over[1], share) - exact).modulus() / exact.modulus()
                };
                assert!(error(1.0) < 0.1, "{width} m, k {k}, {source:?}: {}", error(1.0));
                assert!(error(2.0) > 0.5, "the wave along the face counted twice is rejected");
            }
        }
    }

    /// A receiver rises over the plane of the top: the first edge comes into sight, and both together have no step.
    #[test]
    fn a_receiver_that_rises_over_the_top_hears_no_step() {
        let k = 9.0;
        let heard = |height: f64| {
            let radius = 6f64.hypot(height);
            // About the second edge from the top through the air: π on the plane of the top.
            let angle = PI - libm::atan2(height, 6.0);
            let double = path((4.0, 4.2), (radius, angle), WIDTH, 0.0);
            let mut sum = double.amplitude(k) * Complex::unit(-k * double.length());
            if height > 0.0 {
                let seen = WedgePoint {
                    radius: (6.0 + WIDTH).hypot(height),
                    angle: libm::atan2(height, 6.0 + WIDTH),
                    along: 1e4,
                };
                let first = WedgePoint { radius: 4.0, angle: 4.2, along: 1e4 };
                let single = EdgePath::new(&wedge(), first, seen, [0.0, 2e4], Lit::default(), 1.0);
                sum = single.field(k).into_iter().fold(sum, |sum, term| sum + term);
            }
            sum
        };
        let (below, above) = (heard(-1e-7), heard(1e-7));
        assert!((above - below).modulus() < 0.01 * above.modulus(), "{below:?} {above:?}");
    }

    /// Where the barrier is as thin as a sheet, it has to shade as the sheet does, whose field is exact: what runs back and
    /// forth between the edges, and is left out, is worth 0.4 dB there.
    #[test]
    fn a_barrier_of_no_width_is_nearly_a_sheet() {
        let below = libm::atan(0.3);
        let radius = 10f64.hypot(3.0);
        let sheet = Wedge::new([-DVec3::Z * 1e4, DVec3::Z * 1e4], DVec3::X, DVec3::Y, 2.0 * PI).unwrap();
        let at = |angle| WedgePoint { radius, angle, along: 1e4 };
        let angle = 0.5 * PI - below;
        let thin = EdgePath::new(&sheet, at(angle), at(2.0 * PI - angle), [0.0, 2e4], Lit::default(), 1.0);
        for k in [2.0, 9.0, 40.0] {
            let double = path((radius, PI + below), (radius, PI + below), 1e-3, 0.0).amplitude(k);
            let single = thin.field(k).into_iter().fold(Complex::ZERO, |sum, term| sum + term);
            let error = 20.0 * (double.modulus() / single.modulus()).log10();
            assert!(error.abs() < 0.4, "k {k}: {error} dB");
        }
    }

    #[test]
    fn every_field_is_finite_and_fades_into_the_shadow() {
        for width in [1e-3, 0.1, 1.0, 10.0] {
            for k in [1.0, 20.0, 100.0] {
                let lower = path((4.0, 4.7), (4.0, 4.7), width, 0.3).amplitude(k).modulus();
                let higher = path((4.0, 3.3), (4.0, 3.3), width, 0.3).amplitude(k).modulus();
                assert!(
                    lower.is_finite() && higher.is_finite() && lower < higher,
                    "{width} {k}: {lower} {higher}"
                );
            }
        }
        for (source, receiver) in [((0.0, 0.0), (3.0, 4.0)), ((2.0, 0.0), (2.0, 4.7)), ((2.0, PI), (2.0, PI))]
        {
            assert!(path(source, receiver, 1.0, 0.0).amplitude(5.0).modulus().is_finite());
        }
    }

    #[test]
    fn exchange_of_source_and_receiver_changes_nothing() {
        for k in [2.0, 20.0] {
            let there = path((4.0, 4.2), (2.0, 3.9), WIDTH, 1.0).amplitude(k);
            let back = path((2.0, 3.9), (4.0, 4.2), WIDTH, -1.0).amplitude(k);
            assert!((there - back).modulus() < 1e-4 * there.modulus(), "{there:?} {back:?}");
        }
    }
}
