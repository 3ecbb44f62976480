//! A rigid sphere as a head: impulse responses at its ears for everybody who has measured none.
//!
//! Pressure on a rigid sphere of radius a under a plane wave from the angle θ to the ear, over that at its centre without it:
//! H(μ, θ) = μ⁻² Σ (−i)^(m−1) (2m + 1) P_m(cos θ) / h_m′(μ) with μ = 2π f a / c (convention e^(−iωt)). There is no outer ear: front and rear,
//! above and below sound alike.
//!
//! References: [DudaMartens1998] (docs/references.md).

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use crate::SAMPLE_RATE_HZ;
use crate::head::Head;

/// Radius of a head [m].
const RADIUS: f64 = 0.0875;
/// Speed of sound [m/s].
const SPEED: f64 = 343.0;
/// Samples of a response.
const LENGTH: usize = 256;
/// Samples before the centre of the head hears: sound reaches the nearer ear 12 samples before it, and the band limit rings.
const DELAY: usize = 32;
/// Directions to the sources, evenly spread: neighbours are 6° apart, half of which an ear can just tell in front.
const DIRECTIONS: usize = 1000;
/// Incidence angles between which responses are taken, 1° apart.
const ANGLES: usize = 181;
/// Orders beyond μ of the series: the terms fall off faster than exponentially.
const BEYOND: usize = 20;

impl Head {
    /// A rigid sphere of radius 8.75 cm with its ears at the ends of a diameter.
    #[must_use]
    pub fn sphere() -> Self {
        let by_angle = responses();
        let at = |ear: DVec3, direction: DVec3| {
            let degrees = libm::acos(direction.dot(ear).clamp(-1.0, 1.0)).to_degrees();
            by_angle[degrees.round() as usize].clone()
        };
        let directions = spread();
        let taps = directions.iter().map(|u| [at(DVec3::Y, *u), at(DVec3::NEG_Y, *u)]).collect();
        Self::of_taps(directions, taps)
    }
}

/// Unit vectors spread evenly by the golden angle.
fn spread() -> Vec<DVec3> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let point = |index: usize| {
        let z = 1.0 - (2 * index + 1) as f64 / DIRECTIONS as f64;
        let (sin, cos) = libm::sincos(golden * index as f64);
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    };
    (0..DIRECTIONS).map(point).collect()
}

/// The response at every degree of incidence.
fn responses() -> Vec<Vec<f64>> {
    let mut planner = RealFftPlanner::<f64>::new();
    let backward = planner.plan_fft_inverse(LENGTH);
    let factors: Vec<Vec<Complex<f64>>> = (1..=LENGTH / 2).map(|bin| orders(wave_number(bin))).collect();
    let of_angle = |degrees: usize| {
        let cosine = libm::cos((degrees as f64).to_radians());
        let mut spectrum = backward.make_input_vec();
        spectrum[0] = Complex::new(1.0, 0.0);
        for (bin, factors) in (1..).zip(&factors) {
            let turn = Complex::from_polar(1.0, -TAU * (bin * DELAY) as f64 / LENGTH as f64);
            // e^(−iωt) in the series, e^(+iωt) in the transform.
            spectrum[bin] = sum(factors, cosine).conj() * turn;
        }
        // The highest bin of a real signal is real.
        spectrum[LENGTH / 2].im = 0.0;
        let mut taps = backward.make_output_vec();
        backward.process(&mut spectrum, &mut taps).expect("the ends of a real signal's spectrum are real");
        taps.into_iter().map(|tap| tap / LENGTH as f64).collect()
    };
    (0..ANGLES).map(of_angle).collect()
}

/// μ of a bin.
fn wave_number(bin: usize) -> f64 {
    TAU * bin as f64 * f64::from(SAMPLE_RATE_HZ) / LENGTH as f64 * RADIUS / SPEED
}

/// μ⁻² (−i)^(m−1) (2m + 1) / h_m′(μ) for every order m. The recurrence of h_m upwards is stable, as |h_m| grows.
fn orders(mu: f64) -> Vec<Complex<f64>> {
    let (sin, cos) = libm::sincos(mu);
    // h_(−1) and h_0.
    let mut before = Complex::new(cos, sin) / mu;
    let mut own = Complex::new(sin, -cos) / mu;
    let mut power = Complex::new(0.0, 1.0);
    (0..mu as usize + BEYOND)
        .map(|m| {
            let order = m as f64;
            let derivative = before - own * ((order + 1.0) / mu);
            (before, own) = (own, own * ((2.0 * order + 1.0) / mu) - before);
            let factor = power * (2.0 * order + 1.0) / derivative / (mu * mu);
            power *= Complex::new(0.0, -1.0);
            factor
        })
        .collect()
}

/// Σ factor_m P_m(cos θ).
fn sum(factors: &[Complex<f64>], cosine: f64) -> Complex<f64> {
    let (mut before, mut own) = (0.0, 1.0);
    let mut sum = Complex::new(0.0, 0.0);
    for (m, factor) in factors.iter().enumerate() {
        sum += factor * own;
        let order = m as f64;
        (before, own) = (own, ((2.0 * order + 1.0) * cosine * own - order * before) / (order + 1.0));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Long waves see no head; short ones are doubled at the side they come from, as at a wall.
    #[test]
    fn long_waves_pass_and_short_ones_are_doubled() {
        for degrees in [0.0_f64, 60.0, 120.0, 180.0] {
            let cosine = degrees.to_radians().cos();
            assert!((sum(&orders(1e-3), cosine).norm() - 1.0).abs() < 2e-3, "{degrees}");
        }
        assert!((sum(&orders(30.0), 1.0).norm() - 2.0).abs() < 0.02);
        // Opposite to the source waves around all sides meet: louder than a little beside it.
        assert!(
            sum(&orders(10.0), -1.0).norm() > 2.0 * sum(&orders(10.0), (150.0_f64).to_radians().cos()).norm()
        );
    }

    /// Differences of arrival at the ears follow the way around the sphere, a (θ + sin θ) / c [DudaMartens1998].
    #[test]
    fn the_farther_ear_hears_later_by_the_way_around() {
        let head = Head::sphere();
        let onset = |taps: &[f64]| {
            let peak = taps.iter().fold(0.0_f64, |peak, tap| peak.max(tap.abs()));
            taps.iter().position(|tap| tap.abs() > 0.15 * peak).expect("a peak") as f64
        };
        for azimuth in [30.0_f64, 60.0, 90.0] {
            let angle = azimuth.to_radians();
            let direction = head.nearest(DVec3::new(angle.cos(), angle.sin(), 0.0));
            let difference = onset(head.taps(direction, 1)) - onset(head.taps(direction, 0));
            let expected = RADIUS / SPEED * (angle + angle.sin()) * f64::from(SAMPLE_RATE_HZ);
            assert!((difference - expected).abs() < 4.0, "{azimuth}: {difference} instead of {expected}");
        }
    }
}
