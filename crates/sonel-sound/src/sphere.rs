//! A rigid sphere as a head: impulse responses at its ears for everybody who has measured none.
//!
//! Pressure on a rigid sphere of radius a under a plane wave from the angle θ to the ear, over that at its centre without it:
//! H(μ, θ) = μ⁻² Σ (−i)^(m−1) (2m + 1) P_m(cos θ) / h_m′(μ) with μ = 2π f a / c (convention e^(−iωt)). There is no outer ear: front and rear,
//! above and below sound alike.
//!
//! References: [DudaMartens1998], [AndreopoulouKatz2017] (docs/references.md).

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use realfft::num_complex::Complex;

use crate::SAMPLE_RATE_HZ;
use crate::alignment::Aligned;
use crate::head::Head;
use crate::transform::Transform;

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
        Self::sphere_from(spread())
    }

    /// The same from its responses in these directions.
    fn sphere_from(directions: Vec<DVec3>) -> Self {
        let transform = Transform::new(2 * LENGTH);
        let by_angle: Vec<Aligned> = responses().iter().map(|taps| Aligned::new(taps, &transform)).collect();
        let at = |ear: DVec3, direction: DVec3| {
            let degrees = libm::acos(direction.dot(ear).clamp(-1.0, 1.0)).to_degrees();
            let before = (degrees as usize).min(ANGLES - 2);
            let share = degrees - before as f64;
            Aligned::mean([(1.0 - share, &by_angle[before]), (share, &by_angle[before + 1])].into_iter())
        };
        let responses = directions.iter().map(|u| vec![at(DVec3::Y, *u), at(DVec3::NEG_Y, *u)]).collect();
        Self::new(directions, responses)
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
    let transform = Transform::new(LENGTH);
    let factors: Vec<Vec<Complex<f64>>> = (1..=LENGTH / 2).map(|bin| orders(wave_number(bin))).collect();
    let of_angle = |degrees: usize| {
        let cosine = libm::cos((degrees as f64).to_radians());
        let value = |(bin, factors): (usize, &Vec<Complex<f64>>)| {
            let turn = Complex::from_polar(1.0, -TAU * (bin * DELAY) as f64 / LENGTH as f64);
            // e^(−iωt) in the series, e^(+iωt) in the transform.
            sum(factors, cosine).conj() * turn
        };
        let above_zero = (1..).zip(&factors).map(value);
        transform.signal(std::iter::once(Complex::ONE).chain(above_zero).collect())
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
    use crate::ears::Ears;
    use crate::fractional;

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

    const ONSET: f64 = 0.031_6;

    /// First time at which taps below 3 kHz exceed −30 dB of their peak, between samples [µs]: as listeners lateralise [AndreopoulouKatz2017].
    fn onset(taps: &[f64]) -> f64 {
        // A Hann window of 16 samples takes the ringing of the band limit.
        let window: Vec<f64> = (1..16).map(|at| 1.0 - (TAU * f64::from(at) / 16.0).cos()).collect();
        let product = |taps: &[f64]| taps.iter().zip(&window).map(|(tap, weight)| tap * weight).sum::<f64>();
        let taps: Vec<f32> = taps.windows(window.len()).map(|taps| product(taps) as f32).collect();
        let peak = taps.iter().fold(0.0_f32, |peak, tap| peak.max(tap.abs()));
        let (table, steps) = (fractional::Table::new(), 100_usize);
        let near =
            taps.iter().position(|tap| f64::from(tap.abs()) > ONSET * f64::from(peak)).expect("a peak") - 1;
        let at = |step: usize| near as f64 + step as f64 / steps as f64;
        let step = (0..2 * steps)
            .find(|step| table.read(&taps, at(*step)).abs() > ONSET * f64::from(peak))
            .expect("a peak");
        at(step) * 1e6 / f64::from(SAMPLE_RATE_HZ)
    }

    /// Differences of arrival at the ears follow the way around the sphere, a (θ + sin θ) / c [DudaMartens1998].
    #[test]
    fn the_farther_ear_hears_later_by_the_way_around() {
        let head = Head::sphere();
        let ears = Ears::new(&head);
        let response = |u, ear| ears.sum(ear, vec![(100.0, 1.0, &head.weights(u))]).1;
        for azimuth in [30.0_f64, 60.0, 90.0] {
            let angle = azimuth.to_radians();
            let u = DVec3::new(angle.cos(), angle.sin(), 0.0);
            let [left, right] = [0, 1].map(|ear| onset(&response(u, ear)));
            let expected = RADIUS / SPEED * (angle + angle.sin()) * 1e6;
            assert!(
                (right - left - expected).abs() < 80.0,
                "{azimuth}: {} instead of {expected} µs",
                right - left
            );
        }
    }

    /// The level of taps in octaves from 250 Hz to 8 kHz [dB].
    fn octaves(taps: &[f64]) -> Vec<f64> {
        let transform = Transform::new(2048);
        let mut padded = transform.silence();
        padded[..taps.len()].copy_from_slice(taps);
        let spectrum = transform.spectrum(padded);
        let bin = |frequency: f64| (frequency * 2048.0 / f64::from(SAMPLE_RATE_HZ)) as usize;
        let level = |octave: i32| {
            let center = 1000.0 * 2.0_f64.powi(octave);
            let band = &spectrum[bin(center / 2.0_f64.sqrt())..bin(center * 2.0_f64.sqrt())];
            10.0 * band.iter().map(Complex::norm_sqr).sum::<f64>().log10()
        };
        (-2..=3).map(level).collect()
    }

    /// From measurements 10° apart: the time between the ears is that of the sphere to 10 µs and changes from degree to degree like it
    /// to 5 µs; levels are those of the sphere to 0.5 dB. The measured direction next to each fails. Within 30° of the point opposite
    /// to the source waves from all sides make rings of half a wavelength over the radius, which the grid does not resolve from 4 kHz on.
    #[test]
    fn between_measured_directions_times_run_through_and_levels_stay() {
        let unit = |azimuth: f64, elevation: f64| {
            let (sine, cosine) = elevation.to_radians().sin_cos();
            DVec3::new(cosine * azimuth.to_radians().cos(), cosine * azimuth.to_radians().sin(), sine)
        };
        let grid = (-9..=9).flat_map(|row| (0..36).map(move |column| (f64::from(row), f64::from(column))));
        let grid = grid.filter(|(row, column)| row.abs() < 9.0 || *column == 0.0);
        let head = Head::sphere_from(grid.map(|(row, column)| unit(10.0 * column, 10.0 * row)).collect());
        let ears = Ears::new(&head);
        let response = |u, ear| ears.sum(ear, vec![(100.0, 1.0, &head.weights(u))]).1;
        let exact: Vec<(f64, Vec<f64>)> = responses()
            .iter()
            .map(|response| {
                let mut padded = vec![0.0; 100];
                padded.extend(response);
                padded.resize(2 * LENGTH, 0.0);
                (onset(&padded), octaves(&padded))
            })
            .collect();
        let angles = |azimuth: usize| [90_usize.abs_diff(azimuth), 90 + azimuth.min(180 - azimuth)];
        let (mut differences, mut nearest, mut levels) = (Vec::new(), Vec::new(), 0.0_f64);
        for azimuth in 0..=180 {
            let u = unit(azimuth as f64, 0.0);
            let found = [0, 1].map(|ear| response(u, ear));
            let [near, far] = angles(azimuth).map(|angle| &exact[angle]);
            differences.push(onset(&found[1]) - onset(&found[0]) - (far.0 - near.0));
            let [left, right] = angles((azimuth + 5) / 10 * 10).map(|angle| exact[angle].0);
            nearest.push(right - left - (far.0 - near.0));
            for ((found, exact), angle) in found.iter().zip([near, far]).zip(angles(azimuth)) {
                let resolved = if angle <= 150 { 6 } else { 4 };
                for (found, exact) in octaves(found).iter().zip(&exact.1).take(resolved) {
                    levels = levels.max((found - exact).abs());
                }
            }
        }
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let step =
            |values: &[f64]| values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        let found = (largest(&differences), step(&differences), levels);
        assert!(found.0 < 10.0 && found.1 < 5.0 && found.2 < 0.5, "{found:?}");
        assert!(largest(&nearest) > 30.0 && step(&nearest) > 60.0);
        println!("{found:?}");
    }
}
