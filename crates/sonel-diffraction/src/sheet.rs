//! Second order over two rims of a thin flat sheet, whichever way they run: source, rim, along both sides of the sheet, rim, receiver.
//!
//! What a thin rigid sheet scatters is opposite on its two sides and nothing in its plane beside it. Each rim alone, whose half plane
//! goes on under the receiver, has a step there. What it sends along the face reaches the receiver past the next rim as that of
//! a point source on the face would: with D₁ the first rim's field, R′ the receiver turned about the second rim into the plane, P where
//! the way to it crosses the first rim, and D₂ the second rim's field of a source at P on the face,
//!
//!   H₂ = D₁(S → R′) D₂(P → R) |P R′| e^(jk |P R′|).
//!
//! In the plane D₂ is minus the free field where the way from P crosses the second rim, and nothing elsewhere: over all rims of a convex
//! sheet H₂ is −D₁, whatever its shape, and none of the steps is left. What would run on to a third rim is left out, and with it fades
//! what a receiver near the plane hears over a rim on whose inner side it is.
//!
//! The formula is exact at the receiver's end only. Exchanged, it is exact at the source's: [`SheetPath`] takes the mean of both, each
//! weighted by the other end's square height over the plane.
//!
//! Reference: [Svensson1999] for the parts (docs/references.md); measured against boundary elements in docs/diffraction.md.

use crate::complex::Complex;
use crate::edge_path::{EdgePath, Lit, WAVES};
use crate::wedge::{Wedge, WedgePoint, apex};

/// P keeps this share of the length of its rim, and of the way, from the ends of the rim: what a corner sends comes from the rim about
/// it.
const OFF_THE_ENDS: f64 = 0.25;
/// tan ½θ of the angle over the face below which a second rim fades.
const FADED: f64 = 0.1;

/// A rim of a sheet.
#[derive(Debug, Clone, Copy)]
pub struct Rim<'a> {
    /// The rim.
    pub wedge: &'a Wedge,
    /// The source about it.
    pub source: WedgePoint,
    /// The receiver about it.
    pub receiver: WedgePoint,
    /// Whether the side of the sheet that counts as its front is the second face here.
    pub turned: bool,
    /// The part of it that is seen, from its start [m].
    pub part: [f64; 2],
}

impl Rim<'_> {
    /// Source and receiver exchanged.
    fn exchanged(self) -> Self {
        Self { source: self.receiver, receiver: self.source, ..self }
    }

    /// Angle of the side that counts as the front of the sheet [rad].
    fn front(&self) -> f64 {
        if self.turned { self.wedge.angle() } else { 0.0 }
    }
}

/// A path over two rims of a sheet.
#[derive(Debug, Clone)]
pub struct SheetPath {
    length: f64,
    ways: [OneWay; 2],
}

/// The path as it is exact at one of its ends.
#[derive(Debug, Clone)]
pub struct OneWay {
    first: EdgePath,
    second: EdgePath,
    /// |P R′| [m].
    reach: f64,
    /// Length of the shortest way [m].
    length: f64,
    weight: f64,
    /// The ends of the path over the first rim about that.
    pub ends: [WedgePoint; 2],
}

impl SheetPath {
    /// The path over the `first` and then over the `second` rim, for wave numbers of at least `smallest_k` [1/m]. Within the angle
    /// `within` [rad] of the plane beyond a rim, the side on which an end counts is that on which the other rim has it.
    #[must_use]
    pub fn new(first: Rim<'_>, second: Rim<'_>, within: f64, smallest_k: f64) -> Self {
        let square = |height: f64| height * height;
        let height = |point: WedgePoint| square(point.radius * libm::sin(point.angle));
        let (of_source, of_receiver) = (height(first.source), height(second.receiver));
        let sum = of_source + of_receiver;
        let weight = |height: f64| if sum > 0.0 { height / sum } else { 0.5 };
        let ways = [
            OneWay::new(first, second, weight(of_source), within, smallest_k),
            OneWay::new(second.exchanged(), first.exchanged(), weight(of_receiver), within, smallest_k),
        ];
        Self { length: ways[0].length.min(ways[1].length), ways }
    }

    /// Length of the shortest way over both rims [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The path as it is exact at the receiver's end, and as it is at the source's: the field is the sum of both.
    #[must_use]
    pub fn ways(&self) -> &[OneWay; 2] {
        &self.ways
    }
}

impl OneWay {
    fn new(first: Rim<'_>, second: Rim<'_>, weight: f64, within: f64, smallest_k: f64) -> Self {
        let (source, receiver) = (first.source, second.receiver);
        let beyond = second.wedge.beyond(receiver);
        let turned = first.wedge.in_plane(beyond, first.front());
        let margin = OFF_THE_ENDS * (first.part[1] - first.part[0]).min(source.radius + turned.radius);
        let place = apex(source, turned).clamp(first.part[0] + margin, first.part[1] - margin);
        let from = first.wedge.at(place);
        // On which side of the sheet the receiver is, is for the first rim to say.
        let front = Some((first.receiver.angle - first.front()).abs() < 0.5 * first.wedge.angle());
        let faces = if second.turned { [None, front] } else { [front, None] };
        let lit = Lit { direct: front, faces, within };
        let at_second = second.wedge.in_plane(from, second.front());
        let path =
            |rim: Rim<'_>, from, to, lit| EdgePath::new(rim.wedge, from, to, rim.part, lit, smallest_k);
        let first_path = path(first, source, turned, Lit::default());
        let second_path = path(second, at_second, receiver, lit);
        let reach = from.distance(beyond);
        let length = first_path.detour() + second_path.detour() - reach;
        let weight = weight * off_the_face(receiver.angle - second.front());
        Self { first: first_path, second: second_path, reach, length, weight, ends: [source, turned] }
    }

    /// Amplitudes at wave number `k` by the wave that the first rim completes, to be multiplied by e^(−jk length) [1/m].
    #[must_use]
    pub fn amplitudes(&self, k: f64, length: f64) -> [Complex; WAVES] {
        let second = self.second.field(k).into_iter().fold(Complex::ZERO, |sum, term| sum + term);
        let factor = second * Complex::unit(k * (self.reach + length)) * (self.reach * self.weight);
        self.first.field(k).map(|term| term * factor)
    }
}

/// 1, but near the face on both of its sides, where it is 0.
fn off_the_face(angle: f64) -> f64 {
    let (sine, cosine) = libm::sincos(0.5 * angle);
    sine * sine / (sine * sine + (FADED * cosine) * (FADED * cosine))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, dvec3};
    use sonel_testkit::analytic::rigid_sheet::RigidSheet;
    use std::f64::consts::TAU;

    const SIDES: [[f64; 2]; 2] = [[-1.0, 1.5], [-0.8, 1.2]];
    const K: f64 = 3.0;

    fn rims() -> [Wedge; 4] {
        let [y, z] = SIDES;
        let at = |i: usize, j: usize| dvec3(0.0, y[i], z[j]);
        let rim = |ends, inward| Wedge::new(ends, inward, -DVec3::X, TAU).unwrap();
        [
            rim([at(0, 0), at(1, 0)], DVec3::Z),
            rim([at(1, 0), at(1, 1)], -DVec3::Y),
            rim([at(1, 1), at(0, 1)], -DVec3::Z),
            rim([at(0, 1), at(0, 0)], DVec3::Y),
        ]
    }

    fn path(first: &Wedge, second: &Wedge, source: DVec3, receiver: DVec3) -> SheetPath {
        let rim = |wedge| {
            let at = |point| Wedge::locate(wedge, point).unwrap();
            Rim {
                wedge,
                source: at(source),
                receiver: at(receiver),
                turned: false,
                part: [0.0, wedge.length()],
            }
        };
        SheetPath::new(rim(first), rim(second), 1e-9, K)
    }

    fn field(path: &SheetPath) -> Complex {
        let both = path.ways().iter().flat_map(|way| way.amplitudes(K, path.length()));
        both.fold(Complex::ZERO, |sum, term| sum + term) * Complex::unit(-K * path.length())
    }

    fn free(from: DVec3, to: DVec3) -> Complex {
        Complex::unit(-K * from.distance(to)) * (1.0 / from.distance(to))
    }

    /// Everything over one rim, and everything over two.
    fn orders(source: DVec3, receiver: DVec3) -> [Complex; 2] {
        let mirrored = source * dvec3(-1.0, 1.0, 1.0);
        let meets = |from: DVec3| {
            let place = from.lerp(receiver, from.x / (from.x - receiver.x));
            let within = |[low, high]: [f64; 2], at: f64| low < at && at < high;
            from.x * receiver.x < 0.0 && within(SIDES[0], place.y) && within(SIDES[1], place.z)
        };
        let lit = [(source, !meets(source)), (mirrored, meets(mirrored))].into_iter().filter(|(_, lit)| *lit);
        let mut orders =
            [lit.fold(Complex::ZERO, |sum, (from, _)| sum + free(from, receiver)), Complex::ZERO];
        for (i, first) in rims().iter().enumerate() {
            let ends = [source, receiver].map(|point| first.locate(point).unwrap());
            let over = EdgePath::new(first, ends[0], ends[1], [0.0, first.length()], Lit::default(), K);
            orders[0] = over.field(K).into_iter().fold(orders[0], |sum, term| sum + term);
            for (_, second) in rims().iter().enumerate().filter(|(j, _)| *j != i) {
                orders[1] += field(&path(first, second, source, receiver));
            }
        }
        orders
    }

    const SOURCE: DVec3 = dvec3(-3.0, 0.2, 0.4);

    /// Against boundary elements, which know of no edge: in shadow, before the panel, beside it and far beside its plane. One order
    /// alone is two to six times as far off.
    #[test]
    fn two_orders_are_what_boundary_elements_say() {
        let exact = RigidSheet { sides: SIDES, elements: [16, 14] }.scattered(SOURCE.to_array(), K);
        let beside =
            |x: f64| [dvec3(x, 0.3, 1.3), dvec3(x, 1.8, 0.9), dvec3(x, -1.2, 1.4), dvec3(x, 1.2, -1.8)];
        let over =
            |x: f64| [dvec3(x, 0.3, 0.1), dvec3(x, 1.2, 0.9), dvec3(x, -0.8, 0.5), dvec3(x, 1.2, -0.5)];
        let regions = [
            [over(0.3), over(1.5)].concat(),
            [over(-0.3), over(-1.5)].concat(),
            [beside(1e-3), beside(-0.1)].concat(),
            [beside(0.7), beside(-2.0)].concat(),
        ];
        for (region, receivers) in regions.iter().enumerate() {
            let mut errors = [0.0; 2];
            for &receiver in receivers {
                let (re, im) = exact.pressure(receiver.to_array());
                let exact = free(SOURCE, receiver) + Complex::new(re, im);
                let [once, twice] = orders(SOURCE, receiver);
                let error = |found: Complex| {
                    (found - exact).square_of_modulus() / free(SOURCE, receiver).square_of_modulus()
                };
                errors[0] += error(once) / receivers.len() as f64;
                errors[1] += error(once + twice) / receivers.len() as f64;
            }
            let [once, twice] = errors.map(f64::sqrt);
            assert!(twice < 0.08 && once > 2.0 * twice, "{region}: {once} {twice}");
        }
    }

    /// In the plane beside the panel nothing is scattered, exactly, on either side of it.
    #[test]
    fn in_the_plane_two_orders_are_the_free_field() {
        for place in
            [dvec3(0.0, 0.3, 1.21), dvec3(0.0, 1.45, 1.25), dvec3(0.0, 1.9, 1.6), dvec3(0.0, -1.3, -2.0)]
        {
            for side in [1e-9, -1e-9] {
                let receiver = place + DVec3::X * side;
                let [once, twice] = orders(SOURCE, receiver);
                let left = (once + twice - free(SOURCE, receiver)).modulus() * SOURCE.distance(receiver);
                assert!(left < 1e-4, "{receiver}: {left}");
            }
        }
    }

    #[test]
    fn exchange_of_source_and_receiver_changes_nothing() {
        let [first, second, ..] = &rims();
        for receiver in [dvec3(2.0, 0.5, 1.9), dvec3(0.01, 2.0, 0.5), dvec3(-1.0, 0.0, 0.0)] {
            let there = field(&path(first, second, SOURCE, receiver));
            let back = field(&path(second, first, receiver, SOURCE));
            assert!((there - back).modulus() <= 1e-12 * there.modulus(), "{there:?} {back:?}");
        }
    }

    #[test]
    fn every_field_is_finite() {
        let [first, second, third, _] = &rims();
        let places = [
            DVec3::ZERO,
            dvec3(0.0, 1.5, 1.2),
            dvec3(0.0, 1.5, 4.0),
            dvec3(0.0, 1.5, 0.2),
            dvec3(1e-9, 3.0, 3.0),
        ];
        for other in [second, third] {
            for source in places {
                for receiver in places {
                    assert!(
                        field(&path(first, other, source, receiver)).modulus().is_finite(),
                        "{source} {receiver}"
                    );
                }
            }
        }
    }
}
