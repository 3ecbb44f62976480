//! Two edges that both ends of a path see near the plane of their face.
//!
//! Each form of the product takes one edge to be lit from the other one, which is right unless the boundary of that other one's wave runs
//! along the face: what lights the edge then comes from beyond, and is less curved. With C the product of both edges' fields over the whole
//! way, each as if the other were not there,
//!
//!   C = ½ D₁(S → R′) D₂(S′ → R) |S′R′| e^(jk|S′R′|),
//!
//! the form that is exact at the receiver's end is C R₂, that at the source's C R₁, where R₂ goes from 1 in the plane to γ far off it,
//! γ² = |S′Q| |PR′|/(|PQ| |S′R′|). To lowest order in the angles both edges together are
//!
//!   ∫∫ x/(u² + x²) y/(v² + y²) e^(−u² − v² − 2ρuv) du dv,  ρ² = 1 − γ⁻²,
//!
//! x² and y² the Fresnel numbers of both ends, turned by 45°: C γ where both are large, C R₂ for large x at any y, and C where either is 0.
//! What has these limits,
//!
//!   C (1 + (γ − 1) p q/(λ + (1 − λ)(p + q − p q))),  p = (R₁ − 1)/(γ − 1), q = (R₂ − 1)/(γ − 1), λ = 3/(1 + 2γ),
//!
//! errs by 0.6 % at most for γ = 1.7 and 4 % for γ up to 20. It is C and, of what R₂ adds to it, the share p/(λ + (1 − λ)(p + q − p q)).
//!
//! Reference: docs/decisions/0031-two-forms-are-one.md.

use super::chain::Asked;
use super::way::FaceWay;
use super::{End, FaceEdge};
use crate::complex::Complex;
use crate::contour::SIX;
use crate::edge_path::EdgePath;
use crate::wave_numbers::WaveNumbers;

/// γ − 1 below which there is next to nothing to tell [1].
const ALIKE: f64 = 1e-3;

/// How both forms of the product over two edges are lit.
#[derive(Debug, Clone)]
pub(super) struct Overlap {
    /// Of the receiver's form, and of the source's.
    ends: [Transition; 2],
}

/// An edge lit from the one before, and from where the way begins, both as if it had no end.
#[derive(Debug, Clone)]
struct Transition {
    near: EdgePath,
    far: EdgePath,
    /// |P R′|/|S′R′|.
    shorter: f64,
    /// γ, the ratio far off the plane.
    most: f64,
}

impl Overlap {
    /// The overlap on two edges.
    pub fn new([first, last]: [FaceEdge<'_>; 2], [source, receiver]: [End; 2], asked: Asked) -> Self {
        let there = Transition::new([&first, &last], [source, receiver], asked);
        let back = Transition::new([&last.exchanged(), &first.exchanged()], [receiver, source], asked);
        Self { ends: [there, back] }
    }

    /// The share of what comes from the edge before, at every wave number: past the receiver's edge in its form, and past the source's in the
    /// other; the rest comes straight.
    pub fn nearness(&self, numbers: &WaveNumbers) -> [Vec<Complex>; 2] {
        let [last, first] = [0, 1].map(|end| self.ends[end].ratios(numbers));
        let one = Complex::real(1.0);
        let share = |ratio: Complex, end: usize| (ratio - one) * (1.0 / (self.ends[end].most - 1.0 + ALIKE));
        let of = |(&last, &first): (&Complex, &Complex)| {
            let (q, p) = (share(last, 0), share(first, 1));
            let nearness = |other: Complex, end: usize| {
                let alone = 3.0 / (1.0 + 2.0 * self.ends[end].most);
                other / ((p + q - p * q) * (1.0 - alone) + Complex::real(alone))
            };
            (nearness(p, 0), nearness(q, 1))
        };
        last.iter().zip(&first).map(of).unzip().into()
    }
}

impl Transition {
    /// At the receiver's end.
    fn new([first, last]: [&FaceEdge<'_>; 2], [source, receiver]: [End; 2], asked: Asked) -> Self {
        let way = FaceWay::new([first, last], source.point, receiver);
        let (far, longer) = way.afar([first, last], source);
        let lit = last.lit(receiver, asked.within);
        let endless = |from| EdgePath::endless(SIX, last.wedge, from, receiver.point, lit, asked.smallest_k);
        let [apart, behind] = way.lengths;
        let (reach, whole) = (apart + behind, longer + apart + behind);
        Self {
            near: endless(way.near),
            far: endless(far),
            shorter: reach / whole,
            most: ((longer + apart) * reach / (apart * whole)).sqrt(),
        }
    }

    /// The field of the edge lit from the one before over that lit from where the way begins, at every wave number.
    fn ratios(&self, numbers: &WaveNumbers) -> Vec<Complex> {
        let [near, far] = [&self.near, &self.far].map(|path| path.amplitudes(0, numbers));
        let total = |&[direct, first, second]: &[Complex; 3]| direct + first + second;
        near.iter().zip(&far).map(|(near, far)| total(near) / total(far) * self.shorter).collect()
    }
}
