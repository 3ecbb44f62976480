//! Absorption of a sample of finite size, as reverberation rooms measure it.
//!
//! A sample absorbs more than as much of a wall without end, because sound bends towards its rim: measured α may exceed 1. Of the real specific
//! impedance ζ it absorbs, in a rigid wall and a diffuse field [Thomasson1980],
//!
//!   α = ∫₀¹ 8ζ / |ζ + Z(μ)|² dμ,   Z(μ) = (ik/S) ∫ C(r) e^(−ikr) J₀(kr √(1 − μ²)) dr,
//!
//! where Z is its mean radiation impedance for plane waves of the cosine μ from all around, and C(r) the area that it shares with itself
//! moved by r, mean over directions. Without end Z = 1/μ, and α is the integral of Paris ([`crate::absorption_law`]). Samples are squares here:
//! one of 3 m × 3.6 m has α within 0.1 % of it.
//!
//! Reference: docs/references.md [Thomasson1980].

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

use crate::absorption_law::{impedance_by, random_incidence};

/// Steps in μ and in the direction of r: α is within 0.1 % with them, from 63 Hz to 8 kHz.
const STEPS: u32 = 64;
/// Speed of sound in the laboratory [m/s].
const SPEED: f64 = 343.0;

/// The absorption of a wall without end of what absorbs `absorption` as a sample of `area` [m²] at `frequency` [Hz], 0 … 0.951; [`None`] where no
/// such sample absorbs as much.
#[must_use]
pub fn without_end(absorption: f64, area: f64, frequency: f64) -> Option<f64> {
    let radiation = radiation(area, 2.0 * PI * frequency / SPEED);
    impedance_by(absorption, |impedance| absorbed(&radiation, impedance)).map(random_incidence)
}

/// α of a sample of the specific impedance `impedance`. Steps are even in √μ: Z varies most at grazing incidence.
fn absorbed(radiation: &[[f64; 2]], impedance: f64) -> f64 {
    let share = |(at, [real, imaginary]): (f64, &[f64; 2])| {
        let sum = impedance + real;
        16.0 * at * impedance / (sum * sum + imaginary * imaginary) / f64::from(STEPS)
    };
    midpoints(1.0, STEPS).zip(radiation).map(share).sum()
}

/// Z(μ) of a square of `area` [m²] at the wave number `k` [1/m], real and imaginary part, at the squares of midpoints of √μ.
fn radiation(area: f64, k: f64) -> Vec<[f64; 2]> {
    let side = area.sqrt();
    let rings = STEPS + (8.0 * k * side) as u32;
    let shared = |r: f64| {
        let along =
            |angle: f64| (side - r * libm::cos(angle)).max(0.0) * (side - r * libm::sin(angle)).max(0.0);
        midpoints(FRAC_PI_2, STEPS).map(along).sum::<f64>() / f64::from(STEPS)
    };
    let weight = k * SQRT_2 * side / (area * f64::from(rings));
    let rings: Vec<[f64; 2]> = midpoints(SQRT_2 * side, rings).map(|r| [k * r, weight * shared(r)]).collect();
    let at = |root: f64| {
        let sine = (1.0 - root * root * root * root).sqrt();
        rings.iter().fold([0.0; 2], |[real, imaginary], &[kr, weight]| {
            let weight = weight * libm::j0(kr * sine);
            [real + weight * libm::sin(kr), imaginary + weight * libm::cos(kr)]
        })
    };
    midpoints(1.0, STEPS).map(at).collect()
}

fn midpoints(end: f64, count: u32) -> impl Iterator<Item = f64> {
    (0..count).map(move |step| (f64::from(step) + 0.5) * end / f64::from(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean pressure on a square that moves as a plane wave presses it, by the sum over pairs of its cells [Rayleigh1896]: each is a source on a
    /// rigid wall, and one sees itself as ∫ 1/R dS = 4 ln(1 + √2) times its side.
    fn by_pairs(side: f64, k: f64, cosine: f64) -> [f64; 2] {
        let (count, directions) = (20_u32, 12_u32);
        let cell = side / f64::from(count);
        let sine = (1.0 - cosine * cosine).sqrt();
        let places: Vec<[f64; 2]> =
            midpoints(side, count).flat_map(|x| midpoints(side, count).map(move |y| [x, y])).collect();
        let (mut real, mut imaginary) = (0.0, 0.0);
        for from in &places {
            for to in &places {
                let [x, y] = [to[0] - from[0], to[1] - from[1]];
                let distance = x.hypot(y);
                let all_around = midpoints(FRAC_PI_2 * 4.0, directions)
                    .map(|angle| (k * sine * (x * angle.cos() + y * angle.sin())).cos())
                    .sum::<f64>()
                    / f64::from(directions);
                if distance > 0.0 {
                    let strength = all_around * cell * cell / distance;
                    real += strength * (k * distance).sin();
                    imaginary += strength * (k * distance).cos();
                } else {
                    real += k * cell * cell;
                    imaginary += 4.0 * cell * (1.0 + SQRT_2).ln();
                }
            }
        }
        let scale = k * cell * cell / (2.0 * PI * side * side);
        [scale * real, scale * imaginary]
    }

    #[test]
    fn radiation_is_that_of_the_cells_of_the_square() {
        for k in [1.0, 3.0] {
            let radiation = radiation(9.0, k);
            for at in [20, 44, 60] {
                let root = (at as f64 + 0.5) / f64::from(STEPS);
                let expected = by_pairs(3.0, k, root * root);
                let found = radiation[at];
                let error = (found[0] - expected[0]).hypot(found[1] - expected[1]);
                assert!(error < 0.02, "{k}, {root}: {found:?} {expected:?}");
                assert!((found[0] - 1.0 / (root * root)).hypot(found[1]) > 0.05, "a wall without end");
            }
        }
    }

    /// α of a square of 10.8 m² at ζ = 5, by Gaussian quadrature of another program: 1.1934, 0.9501, 0.8040 at 63, 250, 1000 Hz.
    #[test]
    fn samples_absorb_more_than_walls_and_the_less_the_larger_they_are() {
        for (frequency, expected) in [(63.0, 1.1934), (250.0, 0.9501), (1000.0, 0.8040)] {
            let found = absorbed(&radiation(10.8, 2.0 * PI * frequency / SPEED), 5.0);
            assert!((found - expected).abs() < 2e-3, "{frequency} Hz: {found}");
            let back = without_end(found, 10.8, frequency).unwrap();
            assert!((back - random_incidence(5.0)).abs() < 1e-9, "{frequency} Hz: {back}");
        }
        let [small, large, wall] =
            [without_end(0.7, 10.8, 250.0).unwrap(), without_end(0.7, 1e4, 250.0).unwrap(), 0.7];
        assert!(small < 0.6 && large < wall && wall - large < 0.02, "{small} {large}");
    }

    #[test]
    fn a_sample_may_absorb_more_than_meets_its_area_but_not_all_that_is_near() {
        assert!(without_end(1.1, 10.8, 125.0).is_some_and(|wall| wall > 0.6 && wall < 0.951));
        assert_eq!(without_end(2.5, 10.8, 125.0), None);
        assert_eq!(without_end(0.0, 10.8, 125.0), Some(0.0));
    }
}
