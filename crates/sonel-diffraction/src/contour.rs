//! Quadrature along paths of steepest descent: ∫₀^∞ g(t) e^(−k t²) dt for all wave numbers at once.
//!
//! Nodes lie at t, geometrically spaced in panels of Gauss–Legendre points that double in width, from below the smallest
//! scale on which g or an exponential varies up to where the slowest exponential is spent. They do not depend on k, so g is computed
//! once for all frequencies.
//!
//! Reference: [AbramowitzStegun1964] table 25.4 (docs/references.md).

use crate::complex::Complex;
use crate::wave_numbers::{SPENT, WaveNumbers};

/// Gauss–Legendre points of a panel: those of four on −1 … 1 that are positive, with their weights.
const POINTS: [(f64, f64); 2] =
    [(0.339_981_043_584_856_3, 0.652_145_154_862_546_1), (0.861_136_311_594_052_6, 0.347_854_845_137_453_9)];
/// Nodes in a panel.
const IN_PANEL: usize = 2 * POINTS.len();

/// Panels at most: the smallest scale is then 2^-38 of the longest.
const PANELS: i32 = 38;
/// End of the first panel over the smallest scale [1]. Chosen; doubled, a panel less and a larger error.
const OF_SCALE: f64 = 0.5;
/// End of the first panel over the width 1/√k of the narrowest exponential [1]: four points integrate it to 5e-4.
const OF_WIDTH: f64 = 2.0;

/// Nodes and weights (t, w) for wave numbers within `range` [1/m], where g varies on no scale smaller than
/// `scale` [√m], the innermost panel first.
fn nodes([smallest, largest]: [f64; 2], scale: f64) -> Vec<(f64, f64)> {
    let end = (SPENT / smallest).sqrt();
    let first = (OF_SCALE * scale).min(OF_WIDTH / largest.sqrt()).clamp(libm::ldexp(end, -PANELS), end);
    let panels = libm::ceil(libm::log2(end / first)) as i32;
    let mut nodes = Vec::with_capacity(IN_PANEL * (panels as usize + 1));
    let mut low = 0.0;
    for panel in (0..=panels).rev() {
        let high = libm::ldexp(end, -panel);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        for (node, weight) in POINTS {
            nodes.push((middle - half * node, half * weight));
            nodes.push((middle + half * node, half * weight));
        }
        low = high;
    }
    nodes
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
        let nodes = nodes(range, scale).into_iter();
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
        let mut decays = vec![0.0; count * IN_PANEL];
        for (panel, nodes) in self.nodes.chunks(IN_PANEL).enumerate() {
            for ((p, values), decays) in nodes.iter().zip(decays.chunks_exact_mut(count)) {
                let values = of(values);
                // From the third panel on each has its nodes at twice the t of the one before.
                let left = numbers.decay(*p, panel >= 2, decays);
                for (sum, &decay) in sums.iter_mut().zip(left) {
                    for (sum, value) in sum.iter_mut().zip(values) {
                        *sum += value * decay;
                    }
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
            let integral: f64 = nodes([2.0, 200.0], a).iter().map(|&(t, w)| w * peak(t)).sum();
            let exact = std::f64::consts::FRAC_PI_2 * (k * a * a).exp() * libm::erfc(a * k.sqrt());
            assert!((integral / exact - 1.0).abs() < 1e-3, "{a} {k}: {integral} {exact}");
        }
    }
}
