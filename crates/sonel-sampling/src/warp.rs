//! Warps from the unit square to directions: uniform and after Lambert.
//!
//! Trigonometry is our own or that of the `libm` crate: its bits do not depend on the platform.
//!
//! Reference: [PharrJakobHumphreys2023], ch. A.5 (docs/references.md).

use core::f32::consts::{FRAC_PI_2, TAU};
use glam::Vec3;

/// A direction uniform over the sphere.
#[must_use]
pub fn uniform_sphere([u, v]: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sine, cosine) = sine_cosine_of_turn(v);
    Vec3::new(radius * cosine, radius * sine, z)
}

/// The point of the unit square that [`uniform_sphere`] takes to `direction`.
#[must_use]
pub fn uniform_sphere_inverse(direction: Vec3) -> [f32; 2] {
    [0.5 * (1.0 - direction.z), turn(direction)]
}

/// A direction over the hemisphere about +z with density cos θ / π (Lambert); cos θ is never zero.
#[inline]
#[must_use]
pub fn cosine_hemisphere([u, v]: [f32; 2]) -> Vec3 {
    let (sine, cosine) = sine_cosine_of_turn(v);
    let radius = u.sqrt();
    Vec3::new(radius * cosine, radius * sine, (1.0 - u).sqrt())
}

/// Sine and cosine of `turn` full turns, for `turn` in [0, 1): the nearest quarter is split off exactly, the rest is a
/// Taylor series to below the rounding of f32 (|x| ≤ π/4: x¹¹/11! < 2e-9, x¹⁰/10! < 3e-8). A third of the time of a
/// general function, which has to reduce any angle.
#[inline]
fn sine_cosine_of_turn(turn: f32) -> (f32, f32) {
    let quarters = 4.0 * turn;
    let nearest = (quarters + 0.5) as u32;
    let x = (quarters - nearest as f32) * FRAC_PI_2;
    let y = x * x;
    let sine = x
        * (1.0
            - y * (1.0 / 6.0)
                * (1.0 - y * (1.0 / 20.0) * (1.0 - y * (1.0 / 42.0) * (1.0 - y * (1.0 / 72.0)))));
    let cosine = 1.0
        - y * (1.0 / 2.0) * (1.0 - y * (1.0 / 12.0) * (1.0 - y * (1.0 / 30.0) * (1.0 - y * (1.0 / 56.0))));
    // Which quarter it is cannot be predicted: exchange and signs without branches.
    let (sine, cosine) = if nearest & 1 == 0 { (sine, cosine) } else { (cosine, sine) };
    (negated_if(nearest & 2, sine), negated_if((nearest + 1) & 2, cosine))
}

/// `value` with its sign turned where `two` is 2 rather than 0.
#[inline]
fn negated_if(two: u32, value: f32) -> f32 {
    f32::from_bits(value.to_bits() ^ (two << 30))
}

/// Azimuth as a fraction of a full turn, in [0, 1).
fn turn(direction: Vec3) -> f32 {
    let fraction = libm::atan2f(direction.y, direction.x) / TAU;
    if fraction < 0.0 { (fraction + 1.0).min(1.0 - f32::EPSILON / 2.0) } else { fraction }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Purpose, Stream, StreamFamily};

    fn stream() -> Stream {
        StreamFamily::new(11, Purpose::Packet, [0; 4]).stream(0)
    }

    fn cosine_hemisphere_inverse(direction: Vec3) -> [f32; 2] {
        [direction.x * direction.x + direction.y * direction.y, turn(direction)]
    }

    /// Chi-square of `samples` directions in equal-probability cells of (inverse u, inverse v); the 99.99 % point for
    /// 255 degrees of freedom is 345.
    fn chi_square(sample: impl Fn([f32; 2]) -> Vec3, inverse: impl Fn(Vec3) -> [f32; 2]) -> f64 {
        let (mut stream, samples) = (stream(), 100_000);
        let mut counts = [0_u32; 256];
        for _ in 0..samples {
            let [u, v] = inverse(sample(stream.uniform_pair()));
            counts[((u * 16.0) as usize).min(15) * 16 + ((v * 16.0) as usize).min(15)] += 1;
        }
        let expected = f64::from(samples) / 256.0;
        counts.iter().map(|&count| (f64::from(count) - expected).powi(2) / expected).sum()
    }

    #[test]
    fn samplers_follow_their_density() {
        assert!(chi_square(uniform_sphere, uniform_sphere_inverse) < 345.0);
        assert!(chi_square(cosine_hemisphere, cosine_hemisphere_inverse) < 345.0);
    }

    #[test]
    fn a_uniform_hemisphere_is_not_lambert() {
        let uniform_hemisphere = |u| uniform_sphere(u) * Vec3::new(1.0, 1.0, uniform_sphere(u).z.signum());
        assert!(chi_square(uniform_hemisphere, cosine_hemisphere_inverse) > 345.0);
    }

    #[test]
    fn inverses_return_to_the_square() {
        let mut stream = stream();
        for _ in 0..10_000 {
            let point = stream.uniform_pair();
            for back in [
                uniform_sphere_inverse(uniform_sphere(point)),
                cosine_hemisphere_inverse(cosine_hemisphere(point)),
            ] {
                assert!((back[0] - point[0]).abs() < 1e-6);
                let azimuth_error = (back[1] - point[1]).abs();
                // The azimuth is ill-conditioned only where the direction is (nearly) the pole.
                let radius = point[0].min(1.0 - point[0]).sqrt().max(1e-6);
                assert!(azimuth_error.min(1.0 - azimuth_error) < 1e-6 / radius);
            }
        }
    }

    #[test]
    fn turns_are_sines_and_cosines() {
        for step in 0..100_000 {
            let turn = step as f32 / 100_000.0;
            let (sine, cosine) = sine_cosine_of_turn(turn);
            let angle = f64::from(turn) * std::f64::consts::TAU;
            assert!(
                (f64::from(sine) - angle.sin()).abs() < 2e-7
                    && (f64::from(cosine) - angle.cos()).abs() < 2e-7
            );
        }
    }

    #[test]
    fn lambert_never_leaves_along_the_surface() {
        let grazing = cosine_hemisphere([unit_below_one(), 0.25]);
        assert!(grazing.z > 0.0);
    }

    fn unit_below_one() -> f32 {
        crate::stream::unit_f32(u32::MAX)
    }
}
