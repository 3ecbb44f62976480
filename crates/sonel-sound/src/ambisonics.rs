//! Ambisonics: spherical harmonics of directions up to order 7, and directions with a mean.
//!
//! Channels are in the order of ambisonic channel numbers (ACN) with semi-normalisation (SN3D), as in AmbiX [Nachbar2011]: channel 0 is the
//! pressure, 1, 2 and 3 are y (left), z (up) and x (front). Over all channels of one order the squares add up to 1.
//!
//! A time bin has the energy E and the moment M = E ⟨u⟩ of its directions u. The distribution of largest entropy with this
//! mean is that
//! of von Mises and Fisher [FisherLewisEmbleton1987], ∝ e^(κ u·d) with d = M/|M| and coth κ − 1/κ = |M|/E: from all directions
//! alike where M is 0, from one where |M| = E. Second and higher moments of the field are not kept.
//!
//! References: [Nachbar2011], [FisherLewisEmbleton1987] (docs/references.md).

use glam::DVec3;

/// Highest order.
pub const MOST_ORDER: u32 = 7;

/// Whose front, left and up the channels have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Axes {
    /// Those of the scene: front is x, or y where x is up.
    #[default]
    Scene,
    /// Those of the receiver: front is the horizontal part of its aim.
    Aim,
}

/// Axes of the channels in those of the scene, unit vectors at right angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    front: DVec3,
    left: DVec3,
    up: DVec3,
}

impl Frame {
    /// For a listener with this `left` side, where `up` is up.
    #[must_use]
    pub fn new(left: DVec3, up: DVec3) -> Self {
        Self { front: left.cross(up), left, up }
    }

    /// [`Axes::Scene`], where `up` is up.
    #[must_use]
    pub fn of_scene(up: DVec3) -> Self {
        let front = if up.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
        Self::new(up.cross(front).normalize(), up)
    }

    /// A direction in these axes: front, left, up.
    #[must_use]
    pub fn local(&self, u: DVec3) -> DVec3 {
        DVec3::from_array([self.front, self.left, self.up].map(|axis| axis.dot(u)))
    }

    /// Gains of the channels of all orders up to `order` for a unit vector `u` in the axes of the scene: N P_n^|m|(z) times cos mφ or, for
    /// m < 0, sin |m|φ, by recurrence over the polynomials P_n^m/sin^m θ, from P_m^m = (2m − 1)!! on.
    #[must_use]
    pub fn gains(&self, order: u32, u: DVec3) -> Vec<f64> {
        let [x, y, z] = self.local(u).to_array();
        let mut all = vec![0.0; channels(order)];
        // sin^m θ cos mφ and sin^m θ sin mφ.
        let (mut cosine, mut sine) = (1.0, 0.0);
        let mut sectoral = 1.0;
        for m in 0..=order as usize {
            let (mut before, mut legendre) = (0.0, sectoral);
            // N² = (2 − δ) (n − m)!/(n + m)!
            let mut square = if m == 0 { 1.0 } else { 2.0 / (1..=2 * m).map(|k| k as f64).product::<f64>() };
            for n in m..=order as usize {
                let scaled = f64::sqrt(square) * legendre;
                all[n * (n + 1) + m] = scaled * cosine;
                if m > 0 {
                    all[n * (n + 1) - m] = scaled * sine;
                }
                let [degree, step] = [n, m].map(|number| number as f64);
                let after =
                    ((2.0 * degree + 1.0) * z * legendre - (degree + step) * before) / (degree - step + 1.0);
                (before, legendre) = (legendre, after);
                square *= (degree - step + 1.0) / (degree + step + 1.0);
            }
            sectoral *= 2.0 * m as f64 + 1.0;
            (cosine, sine) = (x * cosine - y * sine, x * sine + y * cosine);
        }
        all
    }
}

/// Channels of all orders up to `order`.
#[must_use]
pub fn channels(order: u32) -> usize {
    ((order + 1) * (order + 1)) as usize
}

/// How directions of a diffuse field are moved so that their mean is another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lean {
    /// Unit vector along the mean.
    axis: DVec3,
    /// κ: 0 as good as diffuse, infinite along one direction.
    concentration: f64,
}

/// Below this mean a field is as good as diffuse: the density differs by 3 · 10⁻⁶ over all directions.
const DIFFUSE: f64 = 1e-6;
/// Above this mean all directions lie within 0.003° of one.
const SINGLE: f64 = 1.0 - 1e-9;

impl Lean {
    /// Towards a `mean` over all directions, of a length of at most 1.
    #[must_use]
    pub fn towards(mean: DVec3) -> Self {
        let concentration = match mean.length() {
            length if length < DIFFUSE => 0.0,
            length if length > SINGLE => f64::INFINITY,
            length => concentration(length),
        };
        Self { axis: mean.normalize_or(DVec3::Z), concentration }
    }

    /// The unit vector `u`, moved: the angle to the mean takes the value that as many exceed, the angle about it stays.
    #[must_use]
    pub fn of(&self, u: DVec3) -> DVec3 {
        let axis = self.axis;
        let before = axis.dot(u);
        let cosine = self.cosine(0.5 * (1.0 - before).clamp(0.0, 2.0));
        let across = (u - before * axis).normalize_or(axis.any_orthonormal_vector());
        cosine * axis + (1.0 - cosine * cosine).max(0.0).sqrt() * across
    }

    /// The cosine of the angle to the axis that is exceeded with the probability `u`, 0 … 1.
    fn cosine(&self, u: f64) -> f64 {
        match self.concentration {
            0.0 => 1.0 - 2.0 * u,
            f64::INFINITY => 1.0,
            // 1 + ln(1 − u (1 − e^(−2κ)))/κ
            kappa => (1.0 + libm::log1p(u * libm::expm1(-2.0 * kappa)) / kappa).clamp(-1.0, 1.0),
        }
    }
}

/// κ with coth κ − 1/κ = `mean`, between 0 and 1, by Newton's method.
fn concentration(mean: f64) -> f64 {
    let mut kappa = mean * (3.0 - mean * mean) / (1.0 - mean * mean);
    for _ in 0..20 {
        let (value, slope) = langevin(kappa);
        kappa -= (value - mean) / slope;
    }
    kappa
}

/// coth κ − 1/κ and its derivative, for κ > 0.
fn langevin(kappa: f64) -> (f64, f64) {
    /// Here the series and the closed form are both exact to 10⁻¹¹.
    const SERIES: f64 = 0.05;
    if kappa < SERIES {
        let square = kappa * kappa;
        let value = kappa * (1.0 / 3.0 - square * (1.0 / 45.0 - square * 2.0 / 945.0));
        return (value, 1.0 / 3.0 - square * (1.0 / 15.0 - square * 2.0 / 189.0));
    }
    let coth = 1.0 + 2.0 / libm::expm1(2.0 * kappa);
    (coth - 1.0 / kappa, 1.0 / (kappa * kappa) - (coth * coth - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;
    use sonel_sampling::warp::uniform_sphere;
    use sonel_sampling::{Purpose, StreamFamily};

    /// A listener who looks along −y in a scene with z up has x at the left.
    const LEFT: DVec3 = DVec3::X;

    #[test]
    fn front_left_and_up_are_positive_in_their_channels() {
        let frame = Frame::new(LEFT, DVec3::Z);
        for (u, channel) in [(DVec3::NEG_Y, 3), (DVec3::X, 1), (DVec3::Z, 2)] {
            let gains = frame.gains(1, u);
            assert_eq!(gains.len(), 4);
            for (other, gain) in gains.iter().enumerate().skip(1) {
                assert!((gain - f64::from(u8::from(other == channel))).abs() < 1e-15, "{u:?}: {gains:?}");
            }
        }
    }

    /// Values of scipy's spherical harmonics of azimuth 40° and elevation −25°, without Condon-Shortley phase, semi-normalised.
    #[test]
    fn channels_are_real_spherical_harmonics() {
        let frame = Frame::new(DVec3::Y, DVec3::Z);
        let (azimuth, elevation) = (40_f64.to_radians(), (-25_f64).to_radians());
        let flat = elevation.cos();
        let gains = frame.gains(3, dvec3(flat * azimuth.cos(), flat * azimuth.sin(), elevation.sin()));
        for (channel, (found, expected)) in gains.iter().zip(EXPECTED).enumerate() {
            assert!((found - expected).abs() < 1e-9, "{channel}: {found} instead of {expected}");
        }
    }

    const EXPECTED: [f64; 16] = [
        1.0,
        0.582_563_416_070,
        -0.422_618_261_741,
        0.694_272_044_015,
        0.700_540_928_492,
        -0.426_434_265_976,
        -0.232_090_707_265,
        -0.508_204_568_482,
        0.123_524_266_784,
        0.509_680_214_476,
        -0.662_013_392_384,
        -0.038_160_747_771,
        0.445_221_793_278,
        -0.045_478_208_252,
        -0.116_730_822_668,
        -0.294_264_009_028,
    ];

    /// Orthogonal over the sphere with mean squares of 1/(2n + 1): Gauss quadrature exact for products of order 7.
    #[test]
    fn orders_are_orthogonal_and_semi_normalised() {
        let frame = Frame::new(LEFT, DVec3::Z);
        let count = channels(MOST_ORDER);
        let mut products = vec![vec![0.0; count]; count];
        let nodes = [
            (0.183_434_642_495_649_8, 0.362_683_783_378_362),
            (0.525_532_409_916_329, 0.313_706_645_877_887_3),
            (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
            (0.960_289_856_497_536_2, 0.101_228_536_290_376_3),
        ];
        for (node, weight) in nodes.into_iter().flat_map(|(z, w)| [(z, w), (-z, w)]) {
            for step in 0..16 {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(step) / 16.0);
                let sine = libm::sqrt(1.0 - node * node);
                let gains = frame.gains(MOST_ORDER, dvec3(sine * cos, sine * sin, node));
                for (row, a) in products.iter_mut().zip(&gains) {
                    row.iter_mut().zip(&gains).for_each(|(sum, b)| *sum += weight * a * b / 32.0);
                }
            }
        }
        for (a, row) in products.iter().enumerate() {
            for (b, product) in row.iter().enumerate() {
                let order = (0..=MOST_ORDER).find(|order| a < channels(*order)).unwrap();
                let expected = if a == b { 1.0 / f64::from(2 * order + 1) } else { 0.0 };
                assert!((product - expected).abs() < 1e-12, "{a} {b}: {product}");
            }
        }
    }

    #[test]
    fn concentrations_have_their_mean_cosine() {
        for mean in [1e-5, 0.01, 0.0167, 0.3, 0.9, 0.999, 1.0 - 1e-8] {
            let (found, _) = langevin(concentration(mean));
            assert!((found / mean - 1.0).abs() < 1e-9, "{found} instead of {mean}");
        }
        let [series, closed] = [0.049_999_999, 0.050_000_001].map(langevin);
        assert!((series.0 - closed.0).abs() < 1e-8 && (series.1 - closed.1).abs() < 1e-8);
    }

    /// The mean of 200 000 directions is within four standard errors, 4/√(3 · 200 000), of the one asked for; another mean is not.
    #[test]
    fn moved_directions_have_the_mean_asked_for() {
        for mean in [DVec3::ZERO, dvec3(0.1, -0.2, 0.05), dvec3(-0.5, 0.3, -0.7)] {
            let (mut stream, mut sum) = (StreamFamily::new(1, Purpose::Pulse, [0; 4]).stream(0), DVec3::ZERO);
            for _ in 0..200_000 {
                let u = uniform_sphere(stream.uniform_pair()).as_dvec3().normalize();
                let moved = Lean::towards(mean).of(u);
                assert!(
                    (moved.length() - 1.0).abs() < 1e-12 && (mean != DVec3::ZERO || moved.distance(u) < 1e-7)
                );
                sum += moved / 200_000.0;
            }
            let is_off = |mean: DVec3| (sum - mean).abs().max_element() > 0.005_16;
            assert!(!is_off(mean) && is_off(mean + dvec3(0.012, 0.0, 0.0)), "{sum} {mean}");
        }
        let single = dvec3(0.6, 0.0, 0.8);
        assert!([DVec3::X, -single].iter().all(|u| Lean::towards(single).of(*u).distance(single) < 1e-12));
    }
}
