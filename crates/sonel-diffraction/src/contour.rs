//! Quadrature along paths of steepest descent: ∫₀^∞ g(t) e^(−k t²) dt for all wave numbers at once.
//!
//! Nodes lie at t, geometrically spaced in panels of Gauss–Legendre points that double in width, from below the smallest
//! scale on which g varies up to where the slowest exponential is spent. They do not depend on k, so g is computed
//! once for all frequencies.
//!
//! Reference: [AbramowitzStegun1964] table 25.4 (docs/references.md).

use crate::complex::Complex;
use crate::wave_numbers::{SPENT, WaveNumbers};

/// Gauss–Legendre points on −1 … 1: those in (0, 1) with their weights.
pub(crate) type Rule = [(f64, f64)];

/// Four points: a hundredth of what is integrated, where one path counts little.
pub(crate) const FOUR: &Rule =
    &[(0.339_981_043_584_856_3, 0.652_145_154_862_546_1), (0.861_136_311_594_052_6, 0.347_854_845_137_453_9)];

/// Six points: a thousandth of what is integrated is enough where two paths are multiplied.
pub(crate) const SIX: &Rule = &[
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_34),
];

/// Ten points.
pub(crate) const TEN: &Rule = &[
    (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

/// Panels at most: the smallest scale is then 2^-38 of the longest.
const PANELS: i32 = 38;
/// End of the first panel over the smallest scale [1]: six points resolve half a scale. Chosen; doubled, a panel less and a larger error.
const FIRST_PANEL: f64 = 0.5;

/// Nodes and weights (t, w) for wave numbers of at least `smallest_k` [1/m], where g varies on no scale smaller than
/// `scale` [√m], with the points of `rule` in every panel, the innermost panel first.
fn nodes(smallest_k: f64, scale: f64, rule: &Rule) -> Vec<(f64, f64)> {
    let end = (SPENT / smallest_k).sqrt();
    let first = (FIRST_PANEL * scale).clamp(libm::ldexp(end, -PANELS), end);
    let panels = libm::ceil(libm::log2(end / first)) as i32;
    let mut nodes = Vec::with_capacity(2 * rule.len() * (panels as usize + 1));
    let mut low = 0.0;
    for panel in (0..=panels).rev() {
        let high = libm::ldexp(end, -panel);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        for (node, weight) in rule {
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
    /// Nodes in a panel.
    panel: usize,
}

impl<const N: usize> Integral<N> {
    /// For wave numbers of at least `smallest_k` [1/m]; `weighted` takes t and the weight of the node there.
    pub(crate) fn new(
        rule: &Rule,
        smallest_k: f64,
        scale: f64,
        weighted: impl Fn(f64, f64) -> [Complex; N],
    ) -> Self {
        let nodes = nodes(smallest_k, scale, rule).into_iter();
        Self { nodes: nodes.map(|(t, weight)| (t * t, weighted(t, weight))).collect(), panel: 2 * rule.len() }
    }

    /// What `of` takes from the functions, integrated.
    pub(crate) fn at<const M: usize>(
        &self,
        numbers: &WaveNumbers,
        of: impl Fn(&[Complex; N]) -> [Complex; M],
    ) -> Vec<[Complex; M]> {
        let count = numbers.values().len();
        let mut sums = vec![[Complex::ZERO; M]; count];
        let mut decays = vec![0.0; count * self.panel];
        for (panel, nodes) in self.nodes.chunks(self.panel).enumerate() {
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
        for (rule, tolerance) in [(TEN, 1e-6), (SIX, 1e-3)] {
            for (a, k) in [(1.0, 2.0), (1e-3, 2.0), (1e-6, 200.0), (0.1, 70.0)] {
                let peak = |t: f64| a / (t * t + a * a) * (-k * t * t).exp();
                let integral: f64 = nodes(2.0, a, rule).iter().map(|&(t, w)| w * peak(t)).sum();
                let exact = std::f64::consts::FRAC_PI_2 * (k * a * a).exp() * libm::erfc(a * k.sqrt());
                assert!((integral / exact - 1.0).abs() < tolerance, "{a} {k}: {integral} {exact}");
            }
        }
    }
}
