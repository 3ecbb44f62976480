//! Quadrature along paths of steepest descent: ∫₀^∞ g(t) e^(−k t²) dt for all wave numbers at once.
//!
//! Nodes lie at t: Gauss–Legendre points of t in a first panel, below the smallest scale on which g or an exponential varies, and of log t in
//! panels of equal ratio from there up to where the slowest exponential is spent. Singularities of g lie where the length of the way is real,
//! at t² on the imaginary axis, and so π/4 off all of log t. Nodes do not depend on k, so g is computed once for all frequencies.
//!
//! Reference: [AbramowitzStegun1964] table 25.4 (docs/references.md).

use crate::complex::Complex;
use crate::wave_numbers::{SPENT, WaveNumbers};

/// Gauss–Legendre points of a panel on −1 … 1, with their weights.
const POINTS: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
];
/// Largest ratio of the ends of a panel [1]: four points then err by (y + √(1 + y²))^(−8) = 1e-4, y = ½π/ln 3.
const RATIO: f64 = 3.0;
/// Least end of the first panel, as a share of where the exponentials are spent [1].
const LEAST: f64 = 1e-11;
/// End of the first panel over the smallest scale [1]. Chosen; doubled, a panel less and a larger error.
const OF_SCALE: f64 = 0.5;
/// End of the first panel over the width 1/√k of the narrowest exponential [1]: four points integrate it to 5e-4.
const OF_WIDTH: f64 = 2.0;

/// Nodes and weights (t, w) for wave numbers within `range` [1/m], where g varies on no scale smaller than
/// `scale` [√m], the innermost panel first.
fn nodes([smallest, largest]: [f64; 2], scale: f64) -> impl Iterator<Item = (f64, f64)> {
    let end = (SPENT / smallest).sqrt();
    let first = (OF_SCALE * scale).min(OF_WIDTH / largest.sqrt()).clamp(LEAST * end, end);
    let nepers = libm::log(end / first);
    let panels = libm::ceil(nepers / libm::log(RATIO)) as usize;
    let half = 0.5 * nepers / panels.max(1) as f64;
    let linear = POINTS.map(|(node, weight)| (0.5 * first * (1.0 + node), 0.5 * first * weight));
    let logarithmic = move |panel: usize| {
        POINTS.map(|(node, weight)| {
            let t = first * libm::exp(half * ((2 * panel + 1) as f64 + node));
            (t, half * weight * t)
        })
    };
    linear.into_iter().chain((0..panels).flat_map(logarithmic))
}

/// ∫₀^∞ g(t) e^(−k t²) dt for N functions g at all wave numbers.
#[derive(Debug, Clone)]
pub(crate) struct Integral<const N: usize> {
    /// t² and g(t) times its weight.
    nodes: Vec<(f64, [Complex; N])>,
}

impl<const N: usize> Integral<N> {
    /// For wave numbers within `range` [1/m]; `weighted` takes t and the weight of the node there.
    pub(crate) fn new(range: [f64; 2], scale: f64, weighted: impl Fn(f64, f64) -> [Complex; N]) -> Self {
        let nodes = nodes(range, scale);
        Self { nodes: nodes.map(|(t, weight)| (t * t, weighted(t, weight))).collect() }
    }

    /// What `of` takes from the functions, integrated.
    pub(crate) fn at<const M: usize>(
        &self,
        numbers: &WaveNumbers,
        of: impl Fn(&[Complex; N]) -> [Complex; M],
    ) -> Vec<[Complex; M]> {
        let count = numbers.values().len();
        let mut sums = vec![[Complex::ZERO; M]; count];
        let mut decays = vec![0.0; count];
        for (p, values) in &self.nodes {
            let values = of(values);
            for (sum, &decay) in sums.iter_mut().zip(numbers.decay(*p, &mut decays)) {
                for (sum, value) in sum.iter_mut().zip(values) {
                    *sum += value * decay;
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_narrow_peak_under_a_gaussian_keeps_its_area() {
        // ∫₀^∞ a/(t² + a²) e^(−k t²) dt = (π/2) e^(k a²) erfc(a √k)
        for (a, k) in [(1.0, 2.0), (1.0, 200.0), (1e-3, 2.0), (1e-6, 200.0), (0.1, 70.0)] {
            let peak = |t: f64| a / (t * t + a * a) * (-k * t * t).exp();
            let integral: f64 = nodes([2.0, 200.0], a).map(|(t, w)| w * peak(t)).sum();
            let exact = std::f64::consts::FRAC_PI_2 * (k * a * a).exp() * libm::erfc(a * k.sqrt());
            assert!((integral / exact - 1.0).abs() < 1e-3, "{a} {k}: {integral} {exact}");
        }
    }
}
