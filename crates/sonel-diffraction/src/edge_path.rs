//! The field of one edge, source to edge to receiver: [Svensson1999] integrated along paths of steepest descent.
//!
//! With η = arsinh((z − z_S)/r_S) + arsinh((z − z_R)/r_R) as variable along the edge the secondary sources of a rigid wedge become
//!
//!   H_d(k) = −(ν/4π) ∫ Σ β_i(η) e^(−jk L)/L dη,  L² = r_S² + r_R² + (z_S − z_R)² + 2 r_S r_R cosh η,
//!   β_i = sin νφ_i / (cosh νη − cos νφ_i),  φ_i = π ± θ_R ∓ θ_S and π ± (θ_R + θ_S),
//!
//! because dz/(m l) = dη/L. Where L = L_e − j t² the exponential is e^(−jk L_e) e^(−k t²): no oscillation is left. The integral over a
//! finite edge is that from the shortest way outwards on both sides less what begins at either end. Each of the three is
//! a slowly varying amplitude times e^(−jk L_e) of its own length, exact for any distance, angle and frequency. The only
//! singularities near the path are those of the boundaries of shadow and reflection, and the nodes refine towards
//! them, so that nothing has to be approximated there and no asymptotic theory has to take over elsewhere.
//!
//! Four terms: the two in θ_R − θ_S belong to the direct path; each of the other two belongs to the mirror image in one face:
//! each wave with its own terms is continuous where it is cut off. Rigid faces; free field e^(−jkr)/r.
//!
//! References: [BiotTolstoy1957], [Svensson1999] (docs/references.md).

use std::f64::consts::PI;

use crate::complex::{Complex, root, unit};
use crate::contour::Integral;
use crate::wave_numbers::WaveNumbers;
use crate::wedge::{Wedge, WedgePoint, apex, index, rapidity};

/// Nearest that a source or receiver comes to the line of the edge, relative to the length of the path: nearer ones are
/// taken to be there, where the field is within as much of its limit on the edge.
const NEAREST: f64 = 1e-9;
/// Shortest path that the above refers to [m]: between two points on the edge the field stays finite.
const SHORTEST: f64 = 1e-3;
/// Least angle between a path and the boundary of a wave [rad]: nearer, half of the wave is there. Errors of 1e-9 in its amplitude follow.
const BOUNDARY: f64 = 1e-9;

/// |sinh x|² below which sinh νx is taken from its series.
const SERIES: f64 = 0.12;
/// Odd numbers 2k + 1, and 1/((2k + 2)(2k + 3)): what is left out of the series is below 1e-8.
const RECIPROCALS: [(f64, f64); 8] = {
    let mut all = [(0.0, 0.0); 8];
    let mut k = 0;
    while k < all.len() {
        let odd = (2 * k + 1) as f64;
        all[k] = (odd, 1.0 / ((odd + 1.0) * (odd + 2.0)));
        k += 1;
    }
    all
};

/// Whether the waves that an edge may cut off reach the receiver, as far as the caller knows; the angles decide the rest.
///
/// On a boundary itself rounding decides on which side the receiver is. The wave and the edge must use the same answer:
/// otherwise half of the wave is missing or counted twice.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Visibility {
    /// The direct wave.
    pub direct: Option<bool>,
    /// The mirror images in the first and in the second face.
    pub faces: [Option<bool>; 2],
    /// Angle from the boundary [rad] within which the above counts rather than the position.
    pub within: f64,
}

/// Terms of the edge by the wave they belong to: the direct one, the images in the first and the second face.
pub const WAVES: usize = 3;

/// Contribution of a stretch that begins at the shortest way or at an end.
#[derive(Debug, Clone)]
struct Stretch {
    /// L_e [m].
    length: f64,
    /// Integral of all waves, −ν/4π included [1/m].
    integral: Integral<WAVES>,
}

/// One edge between a source and a receiver.
#[derive(Debug, Clone)]
pub struct EdgePath {
    detour: f64,
    pieces: Vec<Stretch>,
}

/// A path about a wedge, unfolded.
struct Unfolded {
    source: WedgePoint,
    receiver: WedgePoint,
    secondary: Secondary,
    /// Length over the apex [m].
    shortest: f64,
}

/// What the secondary sources of an edge send from one direction into another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Secondary {
    index: f64,
    /// Whether ν = ½.
    is_rim: bool,
    /// ½ν(φ_i) less the nearest multiple of π: of the two direct terms and the two faces'.
    halves: [f64; 4],
    /// Their sines and cosines.
    turns: [(f64, f64); 4],
}

impl EdgePath {
    /// The path from `source` to `receiver` over the part of the edge between `part` [m from its start], for wave numbers within
    /// `range` [1/m].
    #[must_use]
    pub fn new(
        wedge: &Wedge,
        source: WedgePoint,
        receiver: WedgePoint,
        part: [f64; 2],
        visible: Visibility,
        range: [f64; 2],
    ) -> Self {
        let way = apex(source, receiver);
        // An edge that the shortest way passes beside cuts nothing off: whether a wave is there is not its concern.
        let visible = if part[0] <= way && way <= part[1] { visible } else { Visibility::default() };
        let path = Unfolded::new(wedge.angle(), source, receiver, visible);
        let [low, high] = part.map(|z| rapidity(path.source, path.receiver, z));
        let mut pieces = Vec::with_capacity(3);
        if low < 0.0 && high > 0.0 {
            pieces.push(path.piece(0.0, path.shortest, 2.0, range));
            pieces.push(path.piece(-low, path.length(part[0]), -1.0, range));
            pieces.push(path.piece(high, path.length(part[1]), -1.0, range));
        } else {
            let (near, far) = if low.abs() < high.abs() { (0, 1) } else { (1, 0) };
            let at = [low.abs(), high.abs()];
            pieces.push(path.piece(at[near], path.length(part[near]), 1.0, range));
            pieces.push(path.piece(at[far], path.length(part[far]), -1.0, range));
        }
        Self { detour: path.length(way.clamp(part[0], part[1])), pieces }
    }

    /// The path between two points over an edge without ends, about air of `angle` [rad]: one piece.
    pub(crate) fn endless(
        angle: f64,
        [source, receiver]: [WedgePoint; 2],
        visible: Visibility,
        range: [f64; 2],
    ) -> Self {
        let path = Unfolded::new(angle, source, receiver, visible);
        Self { detour: path.shortest, pieces: vec![path.piece(0.0, path.shortest, 2.0, range)] }
    }

    /// Length of the shortest way over the edge [m].
    #[must_use]
    pub fn detour(&self) -> f64 {
        self.detour
    }

    /// The lengths [m] with which the amplitudes of [`EdgePath::amplitudes`] rotate.
    pub fn lengths(&self) -> impl Iterator<Item = f64> + '_ {
        self.pieces.iter().map(|piece| piece.length)
    }

    /// Slowly varying amplitudes of piece `piece` at every wave number: by wave, to be multiplied by e^(−jk length) [1/m].
    #[must_use]
    pub fn amplitudes(&self, piece: usize, numbers: &WaveNumbers) -> Vec<[Complex; WAVES]> {
        self.pieces[piece].integral.at(numbers, |values| *values)
    }

    /// Slowly varying amplitudes of all waves of piece `piece` together [1/m].
    pub(crate) fn slow_totals(&self, piece: usize, numbers: &WaveNumbers) -> Vec<Complex> {
        self.pieces[piece].integral.at(numbers, total).into_flattened()
    }

    /// The field at every wave number by wave, relative to a source of free field e^(−jkr)/r [1/m].
    #[must_use]
    pub fn fields(&self, numbers: &WaveNumbers) -> Vec<[Complex; WAVES]> {
        self.sum(numbers, |values| *values)
    }

    /// The field of all waves together at every wave number [1/m].
    #[must_use]
    pub fn totals(&self, numbers: &WaveNumbers) -> Vec<Complex> {
        self.sum(numbers, total).into_flattened()
    }

    fn sum<const N: usize>(
        &self,
        numbers: &WaveNumbers,
        of: impl Fn(&[Complex; WAVES]) -> [Complex; N],
    ) -> Vec<[Complex; N]> {
        let mut sums = vec![[Complex::ZERO; N]; numbers.values().len()];
        for piece in &self.pieces {
            let amplitudes = piece.integral.at(numbers, &of);
            for ((sum, amplitudes), k) in sums.iter_mut().zip(amplitudes).zip(numbers.values()) {
                let turn = unit(-k * piece.length);
                for (sum, amplitude) in sum.iter_mut().zip(amplitudes) {
                    *sum += amplitude * turn;
                }
            }
        }
        sums
    }

    /// The field at one wave number `k` [1/m].
    #[must_use]
    pub fn field(&self, k: f64) -> [Complex; WAVES] {
        self.fields(&k.into())[0]
    }
}

/// All waves together.
fn total(&[direct, first, second]: &[Complex; WAVES]) -> [Complex; 1] {
    [direct + first + second]
}

impl Unfolded {
    fn new(angle: f64, mut source: WedgePoint, mut receiver: WedgePoint, visible: Visibility) -> Self {
        let offset = receiver.along - source.along;
        let nearest = NEAREST * (source.radius + receiver.radius + offset.abs()).max(SHORTEST);
        source.radius = source.radius.max(nearest);
        receiver.radius = receiver.radius.max(nearest);
        Self {
            secondary: Secondary::new(angle, source.angle, receiver.angle, visible),
            shortest: libm::hypot(source.radius + receiver.radius, offset),
            source,
            receiver,
        }
    }

    /// Length of the way over the point at `along` [m].
    fn length(&self, along: f64) -> f64 {
        libm::hypot(self.source.radius, along - self.source.along)
            + libm::hypot(self.receiver.radius, along - self.receiver.along)
    }

    /// `share` times the stretch from η = `from` outwards, where the way has `length` [m].
    fn piece(&self, from: f64, length: f64, share: f64, range: [f64; 2]) -> Stretch {
        let product = self.source.radius * self.receiver.radius;
        let half_from = libm::sinh(0.5 * from);
        // (cosh η − 1)/2 where the stretch begins.
        let rise = half_from * half_from;
        let scale = if rise > 0.0 { self.scale_of_end(rise, length) } else { self.scale_of_apex() };
        let turn = share * -self.secondary.index / (4.0 * PI);
        let weighted = |t: f64, weight: f64| {
            // L² − L_e² over 4 r_S r_R t², the rise of (cosh η − 1)/2 per t².
            let per_square = Complex::new(-t * t, -2.0 * length) * (0.25 / product);
            let (t_over_sine, sine) = if rise > 0.0 {
                let sine = root(Complex::from(rise) + per_square * (t * t));
                (sine.inv() * t, sine)
            } else {
                let apex = root(per_square);
                (apex.inv(), apex * t)
            };
            // dη/L = dL/(r_S r_R sinh η) with dL = −2j t dt and sinh η = 2 sinh ½η cosh ½η.
            let cosine = root(Complex::from(1.0) + sine * sine);
            let measure = Complex::new(0.0, -weight * turn / product) * t_over_sine * cosine.inv();
            self.secondary.terms(sine, cosine).map(|term| term * measure)
        };
        Stretch { length, integral: Integral::new(range, scale, weighted) }
    }

    /// √(L_0 − L) of the nearest singularity: a wave's straight path L, or the path past the far side of the edge.
    fn scale_of_apex(&self) -> f64 {
        let product = self.source.radius * self.receiver.radius;
        let sine = libm::sin(self.secondary.nearest());
        let excess = 4.0 * product * sine * sine;
        (excess / (2.0 * self.shortest)).sqrt()
    }

    /// √(L_e − L_0), where the root that is sinh η branches.
    fn scale_of_end(&self, rise: f64, length: f64) -> f64 {
        (4.0 * self.source.radius * self.receiver.radius * rise / (length + self.shortest)).sqrt()
    }
}

impl Secondary {
    /// About air of `angle`, from a source to a receiver at these angles [rad].
    pub(crate) fn new(angle: f64, source: f64, receiver: f64, visible: Visibility) -> Self {
        let index = index(angle);
        let half = |turn: f64, lit_by: Option<bool>| {
            let half = 0.5 * index * turn;
            let half = half - PI * libm::round(half / PI);
            // A wave is there where the half angle is positive.
            let size = half.abs().max(BOUNDARY);
            let close = 2.0 * size <= index * visible.within;
            let positive = lit_by.filter(|_| close).unwrap_or(half >= 0.0);
            if positive { size } else { -size }
        };
        let (between, sum) = (receiver - source, receiver + source);
        let halves = [
            half(PI - between, visible.direct),
            half(PI + between, visible.direct),
            half(PI - sum, visible.faces[0]),
            half(PI + sum, visible.faces[1]),
        ];
        let is_rim = (index - 0.5).abs() <= f64::EPSILON;
        Self { turns: halves.map(libm::sincos), halves, index, is_rim }
    }

    /// Σ β by wave, from sinh ½η and cosh ½η: cosh νη − cos 2h = 2 (sinh² ½νη + sin² h).
    pub(crate) fn terms(&self, half_sine: Complex, half_cosine: Complex) -> [Complex; WAVES] {
        let square = if self.is_rim {
            // sinh² ¼η = ½ sinh² ½η/(1 + cosh ½η).
            half_sine * half_sine * (half_cosine + Complex::from(1.0)).inv() * 0.5
        } else {
            let sine = multiple_sine(self.index, half_sine, half_cosine);
            sine * sine
        };
        let [a, b, first, second] =
            self.turns.map(|(sine, cosine)| (square + Complex::from(sine * sine)).inv() * (sine * cosine));
        [a + b, first, second]
    }

    /// Half the distance in η to the singularity that is nearest to the shortest way [rad].
    pub(crate) fn nearest(&self) -> f64 {
        let nearest = self.halves.iter().map(|half| (half.abs() / self.index).min(0.5 * PI));
        nearest.fold(0.5 * PI, f64::min)
    }
}

/// sinh νx from sinh x and cosh x, for a real part of x of at least 0, to 1e-8.
fn multiple_sine(index: f64, sine: Complex, cosine: Complex) -> Complex {
    if sine.norm_sqr() < SERIES {
        // ν sinh x ∏ₖ (1 + (ν² − (2k + 1)²)/((2k + 2)(2k + 3)) sinh² x (1 + …)): exact at small x, where the contours begin.
        let square = sine * sine;
        let series = RECIPROCALS.iter().rev().fold(Complex::from(1.0), |series, (odd, reciprocal)| {
            Complex::from(1.0) + square * series * ((index * index - odd * odd) * reciprocal)
        });
        return sine * series * index;
    }
    let exponential = sine + cosine;
    let growth = libm::exp(0.5 * index * libm::log(exponential.norm_sqr()));
    let turn = unit(index * libm::atan2(exponential.im, exponential.re));
    Complex::new(0.5 * (growth - 1.0 / growth) * turn.re, 0.5 * (growth + 1.0 / growth) * turn.im)
}

#[cfg(test)]
mod tests;
