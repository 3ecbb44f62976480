//! Two edges where source and receiver are near the plane of their face.
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
//! What has these limits is in `transition`.
//! What that lacks where the face is narrower than the wavelength is in [`super::narrow`].

use super::narrow::{Narrow, Narrowness, ONE};
use super::way::FaceWay;
use super::{End, FaceEdge, FaceQuery};
use crate::complex::Complex;
use crate::edge_path::EdgePath;
use crate::transition::{Transition, share_beside};
use crate::wave_numbers::WaveNumbers;

/// How an edge is lit, in shares of its field lit from where the way begins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Light {
    /// What comes from the edge before instead.
    pub near: Complex,
    /// What a narrow face adds.
    pub more: Complex,
}

/// How both forms of the product over two edges are lit.
#[derive(Debug, Clone)]
pub(super) struct Overlap {
    /// Transitions of the receiver's form and of the source's.
    ends: [Transition; 2],
    narrow: Narrow,
}

impl Overlap {
    /// The overlap on two edges.
    pub(super) fn new(
        [first, last]: [FaceEdge<'_>; 2],
        [source, receiver]: [End; 2],
        asked: FaceQuery,
    ) -> Self {
        let (there, width) = transition([&first, &last], [source, receiver], asked);
        let (back, width_back) = transition([&last, &first], [receiver, source], asked);
        let width = 0.5 * (width + width_back);
        Self { narrow: Narrow::new([first, last], [source, receiver], width, asked), ends: [there, back] }
    }

    /// How the receiver's edge is lit in its form, and the source's in the other, at every wave number.
    pub(super) fn lights(&self, numbers: &WaveNumbers) -> [Vec<Light>; 2] {
        let [last, first] = [0, 1].map(|end| self.ends[end].shares(numbers));
        let narrow = self.narrow.narrowness(numbers);
        let lights = |end: usize, own: &[Complex], other: &[Complex]| {
            let most = self.ends[end].most;
            let light = |((own, other), narrow): ((&Complex, &Complex), &Narrowness)| {
                let near = share_beside([*own, *other], most);
                let whole = near * *own + narrow.lacking;
                Light { near, more: (narrow.lacking + whole * (narrow.repeated - ONE)) * (most - 1.0) }
            };
            own.iter().zip(other).zip(&narrow).map(light).collect()
        };
        [lights(0, &last, &first), lights(1, &first, &last)]
    }
}

/// The transition at the receiver's end, and the width of the face where the way crosses it [m].
fn transition(
    [first, last]: [&FaceEdge<'_>; 2],
    [source, receiver]: [End; 2],
    asked: FaceQuery,
) -> (Transition, f64) {
    let way = FaceWay::new([first, last], source.point, receiver);
    let (far, longer) = way.afar([first, last], source);
    let lit = last.lit(receiver, asked.within);
    let endless = |from| EdgePath::endless(last.wedge.angle(), [from, receiver.point], lit, asked.range);
    let [apart, behind] = way.lengths;
    let (reach, whole) = (apart + behind, longer + apart + behind);
    let most = ((longer + apart) * reach / (apart * whole)).sqrt();
    let transition = Transition { near: endless(way.near), far: endless(far), shorter: reach / whole, most };
    (transition, way.across([first, last]))
}
