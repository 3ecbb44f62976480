//! Diffraction over two edges of a face that is narrow compared with the distances of source and receiver.
//!
//! Where the ends are far off compared with the width a of the face, only how far two places are from one another along the edges matters, and
//! both lines of secondary sources are one integral over η,
//!
//!   H₂ ∝ ∫ Σβ₁(η) Σβ₂(η) e^(−jka cosh η) dη.
//!
//! In shares of what it is for large ka, with Σβ in its place at η = 0, it is M₁₂, and M₁ and M₂ with the other edge's Σβ at η = 0. In
//! the same limit `overlap` says M₁M₂/(M₁ + M₂ − M₁M₂), which knows of the poles that are near η = 0 alone: the difference is what it lacks
//! where the face is narrower than the wavelength, up to 1.6 dB deep in shadow. It vanishes where either end is in the plane of the face.
//!
//! Sound also runs back and forth. Each edge sends what comes along the face from X back along it to a place P at the other one,
//!
//!   ρ = ½ D(X → P) |XP| e^(jk|XP|),
//!
//! and H₂ + H₄ + … is about H₂/(1 − q). For small ka X is at P, for large ka far off: ρ₁ρ₂ e^(−2jka) is twice as much with X far off than at P in
//! the one limit, half as much in the other. A third of their sum is right in both, and within 0.003 between: q is worth up to
//! 0.5 dB. H₃, which ends at the edge where it began, is left out.
//!
//! Reference: [Svensson1999] for the secondary sources.

use std::f64::consts::PI;

use super::{End, FaceEdge, FaceQuery};
use crate::complex::{Complex, root, unit};
use crate::contour::Integral;
use crate::edge_path::{EdgePath, Secondary, Visibility};
use crate::wave_numbers::WaveNumbers;
use crate::wedge::WedgePoint;

/// Least width of a face [m]; it keeps quotients finite.
const NARROWEST: f64 = 1e-6;
/// Distance that stands for infinity [widths of the face]: angles differ by a thousandth.
const FAR: f64 = 1e3;
/// One.
pub(super) const ONE: Complex = Complex::new(1.0, 0.0);

/// Two edges of a narrow face.
#[derive(Debug, Clone)]
pub(super) struct Narrow {
    /// a, across both edges [m].
    width: f64,
    /// Integrals of M₁, M₂ and M₁₂ along cosh η = 1 − j t²/a.
    integral: Integral<3>,
    /// Way back of the first edge, and of the last one where its air has another angle.
    back: (Back, Option<Back>),
}

/// What an edge sends back along the face.
#[derive(Debug, Clone)]
struct Back {
    /// D(X → P) for X at P and far off, and |XP| [m].
    paths: [(EdgePath, f64); 2],
}

/// What a narrow face does at one wave number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Narrowness {
    /// M₁₂ less what `overlap` says it is.
    pub lacking: Complex,
    /// (H₂ + H₄ + …)/H₂.
    pub repeated: Complex,
}

impl Narrow {
    /// The face between `first` and `last`, `width` [m] wide.
    pub(super) fn new(
        [first, last]: [FaceEdge<'_>; 2],
        [source, receiver]: [End; 2],
        width: f64,
        asked: FaceQuery,
    ) -> Self {
        let width = width.max(NARROWEST);
        let edges = [last.secondary(receiver, asked.within), first.secondary(source, asked.within)];
        let alike = (first.wedge.angle() - last.wedge.angle()).abs() <= f64::EPSILON;
        let back = |edge: &FaceEdge<'_>| Back::new(edge.wedge.angle(), width, asked);
        let back = (back(&first), (!alike).then(|| back(&last)));
        Self { width, integral: integral(edges, width, asked.range), back }
    }

    /// At every wave number.
    pub(super) fn narrowness(&self, numbers: &WaveNumbers) -> Vec<Narrowness> {
        let first = self.back.0.shares(numbers);
        let last = self.back.1.as_ref().map(|back| back.shares(numbers));
        let both = first.iter().zip(last.as_ref().unwrap_or(&first));
        let there_and_back = both.zip(numbers.values()).map(|((first, last), k)| {
            (first[0] * last[0] + first[1] * last[1]) * unit(-2.0 * k * self.width) * (1.0 / 3.0)
        });
        let narrowness = |([first, last, both], again): ([Complex; 3], Complex)| Narrowness {
            lacking: both - first * last / (first + last - first * last),
            repeated: ONE / (ONE - again),
        };
        self.shares(numbers).into_iter().zip(there_and_back).map(narrowness).collect()
    }

    /// M₁, M₂ and M₁₂.
    fn shares(&self, numbers: &WaveNumbers) -> Vec<[Complex; 3]> {
        let sums = self.integral.at(numbers, |values| *values).into_iter();
        let normed = |(sum, k): ([Complex; 3], &f64)| sum.map(|sum| sum * (2.0 * (k / PI).sqrt()));
        sums.zip(numbers.values()).map(normed).collect()
    }
}

impl Back {
    /// Way back of an edge with air of `angle` [rad] on a face that is `width` [m] wide.
    fn new(angle: f64, width: f64, asked: FaceQuery) -> Self {
        let on_face = |radius: f64| WedgePoint { radius, angle: 0.0, along: 0.0 };
        let paths = [width, FAR * width].map(|from| {
            let ends = [from, width].map(on_face);
            (EdgePath::endless(angle, ends, Visibility::default(), asked.range), from + width)
        });
        Self { paths }
    }

    /// ρ at every wave number, for X at P and far off.
    fn shares(&self, numbers: &WaveNumbers) -> Vec<[Complex; 2]> {
        let of = |(path, reach): &(EdgePath, f64)| {
            let totals = path.slow_totals(0, numbers).into_iter();
            totals.map(|total| total * (0.5 * reach)).collect::<Vec<Complex>>()
        };
        let [near, far] = [0, 1].map(|at| of(&self.paths[at]));
        near.into_iter().zip(far).map(|(near, far)| [near, far]).collect()
    }
}

/// Σβ of one edge, of the other one, and of both, in shares of what they are at η = 0: each integral is 1 over 2√(k/π) where they do not
/// change.
fn integral(edges: [Secondary; 2], width: f64, range: [f64; 2]) -> Integral<3> {
    let total = |edge: &Secondary, half_sine: Complex, half_cosine: Complex| {
        let [direct, first, second] = edge.terms(half_sine, half_cosine);
        direct + first + second
    };
    let most = [0, 1].map(|edge| total(&edges[edge], Complex::ZERO, ONE));
    let nearest = edges.iter().map(Secondary::nearest).fold(0.5 * PI, f64::min);
    let scale = libm::sin(nearest) * (2.0 * width).sqrt();
    // sinh ½η = t √(−j/2a).
    let per_t = root(Complex::new(0.0, -0.5 / width));
    Integral::new(range, scale, |t, weight| {
        let sine = per_t * t;
        let cosine = root(ONE + sine * sine);
        let measure = cosine.inv() * weight;
        let [first, last] = [0, 1].map(|edge| total(&edges[edge], sine, cosine) / most[edge]);
        [first, last, first * last].map(|value| value * measure)
    })
}
