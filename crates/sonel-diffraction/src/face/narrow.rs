//! Parallel edges of a face that is narrow to its length, as the top of a barrier.
//!
//! Where a face is narrower than the wavelength what lights its second edge is no point source on the first, and a product of two fields is
//! too loud by up to 6 dB. For edges without ends the double integral of [`crate::double`] is exact: what it says over what the product
//! says of the same edges without ends is the factor for those with ends.

use super::chain::{Asked, Chain, mean};
use super::{End, FaceEdge};
use crate::complex::Complex;
use crate::double::{DoublePath, Side};
use crate::wave_numbers::WaveNumbers;
use std::f64::consts::PI;

/// A face is narrow if its edges are so many times as long as it is wide.
const SLENDER: f64 = 4.0;
/// An edge that reaches so many lengths of the way beyond it has no end.
const ENDLESS: f64 = 1e3;
/// How far beside a boundary a place counts that lies on it [rad]: beyond what [`crate::edge_path`] takes for the boundary.
const BESIDE: f64 = 1e-7;

/// What a narrow face makes of the product over its edges.
#[derive(Debug, Clone)]
pub(super) struct Narrow {
    double: DoublePath,
    product: Vec<Chain>,
}

impl Narrow {
    /// [`None`] for a face that is not narrow, edges that are not parallel, and sheets.
    pub fn new(edges: [FaceEdge<'_>; 2], ends: [End; 2], asked: Asked) -> Option<Self> {
        let [first, second] = edges.map(|edge| edge.wedge);
        let width = first.across(second).filter(|_| !(first.is_rim() && second.is_rim()))?;
        if SLENDER * width > first.length().min(second.length()) {
            return None;
        }
        let [source, receiver] = ends.map(|end| end.point);
        let offset = (second.at(receiver.along) - first.at(source.along)).dot(first.direction());
        let side = |edge: usize, towards: usize| {
            let (FaceEdge { wedge, at_second, .. }, end) = (edges[edge], ends[edge]);
            let (mut point, joint) = (end.point, edges[edge].face(towards));
            if ((point.angle - joint).abs() - PI).abs() <= asked.within {
                let turn = PI + if end.before { -BESIDE } else { BESIDE };
                point.angle = (joint - turn).abs();
            }
            Side { wedge, point, joined_at_second: at_second[towards] }
        };
        let double = DoublePath::new(side(0, 1), side(1, 0), width, offset, asked.smallest_k);
        let reach = ENDLESS * double.length();
        let endless = |edge: usize| {
            let middle = ends[edge].point.along;
            FaceEdge { part: [middle - reach, middle + reach], outline: &[], ..edges[edge] }
        };
        let unfaded = Asked { fades: false, ..asked };
        let product = mean(&[endless(0), endless(1)], ends[0], ends[1], unfaded);
        Some(Self { double, product: product.into_iter().flat_map(|part| part.chains).collect() })
    }

    /// The factor at every wave number.
    pub fn ratios(&self, numbers: &WaveNumbers) -> Vec<Complex> {
        let mut products = vec![Complex::ZERO; numbers.values().len()];
        for chain in &self.product {
            let amplitudes = chain.amplitudes(numbers, self.double.length());
            for (product, terms) in products.iter_mut().zip(amplitudes) {
                *product = terms.into_iter().fold(*product, |sum, term| sum + term);
            }
        }
        let ratio = |(double, product): (Complex, Complex)| {
            if product.square_of_modulus() > 0.0 { double / product } else { Complex::real(1.0) }
        };
        self.double.amplitudes(numbers).into_iter().zip(products).map(ratio).collect()
    }
}
