//! Writes the directivity of `scenes/loudspeaker`: a two-way loudspeaker computed from its sizes.
//!
//! Both drivers are rigid pistons in a baffle, p ∝ 2 J₁(k a sin θ)/(k a sin θ), one above the other, with a crossover that keeps them in
//! phase: w = 1/(1 + (f/f₀)⁴) and 1 − w. The cabinet of half width b makes low frequencies omnidirectional:
//! p ∝ (1 + g cos θ)/(1 + g), g = (kb)²/(1 + (kb)²). Energies are means over frequencies of the octave.
//!
//! Reference: [Kuttruff2009] for the piston.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use anyhow::Result;
use sonel_acoustics::{Bands, energy_to_level_db};
use xtask::workspace::write;

const FILE: &str = "scenes/loudspeaker/loudspeaker.csv";
/// Radii of woofer and tweeter [m].
const RADII: [f64; 2] = [0.065, 0.0125];
/// Distance between their centres [m].
const SPACING: f64 = 0.14;
/// Crossover frequency [Hz].
const CROSSOVER: f64 = 2_000.0;
/// Half width of the cabinet [m].
const HALF_WIDTH: f64 = 0.1;
/// [m/s]
const SPEED_OF_SOUND: f64 = 343.2;
/// Frequencies in an octave.
const FREQUENCIES: u32 = 16;
/// Steps between azimuths and between polar angles [°].
const STEPS: [usize; 2] = [15, 5];
/// Lowest level written [dB].
const LOWEST: f64 = -60.0;

/// Rewrites the table.
pub(crate) fn run() -> Result<()> {
    write(FILE, table())
}

fn table() -> String {
    let bands = Bands::octaves();
    let names: Vec<String> = bands.nominal().iter().map(f64::to_string).collect();
    let mut text = format!(
        "# Two-way loudspeaker, level [dB] re axis, computed by `cargo pages loudspeaker`: no measurement.\n\
         azimuth_deg,polar_deg,{}\n",
        names.join(",")
    );
    for (azimuth, polar) in
        (0..=90).step_by(STEPS[0]).flat_map(|a| (0..=180).step_by(STEPS[1]).map(move |p| (a, p)))
    {
        let radians = |degrees: usize| degrees as f64 / 180.0 * PI;
        let levels: Vec<String> = (0..bands.count())
            .map(|band| {
                let energy = |azimuth, polar| energy(bands.edges(band), radians(azimuth), radians(polar));
                let level = energy_to_level_db(energy(azimuth, polar) / energy(0, 0)).max(LOWEST);
                // Without the sign of a zero.
                format!("{:.1}", (level * 10.0).round() / 10.0 + 0.0)
            })
            .collect();
        let _ = writeln!(text, "{azimuth},{polar},{}", levels.join(","));
    }
    text
}

/// Mean energy over the band between two frequencies [Hz].
fn energy((low, high): (f64, f64), azimuth: f64, polar: f64) -> f64 {
    let of = |index: u32| {
        let share = (f64::from(index) + 0.5) / f64::from(FREQUENCIES);
        at_frequency(low * libm::pow(high / low, share), azimuth, polar)
    };
    (0..FREQUENCIES).map(of).sum::<f64>() / f64::from(FREQUENCIES)
}

/// |p|² relative to the axis at a frequency [Hz].
fn at_frequency(frequency: f64, azimuth: f64, polar: f64) -> f64 {
    let k = TAU * frequency / SPEED_OF_SOUND;
    let ratio = libm::pow(frequency / CROSSOVER, 4.0);
    let [woofer, tweeter] = RADII.map(|radius| piston(k * radius * libm::sin(polar)));
    let shares = [woofer / (1.0 + ratio), tweeter * ratio / (1.0 + ratio)];
    // Half of the phase between the drivers: in phase on the axis.
    let phase = 0.5 * k * SPACING * libm::sin(polar) * libm::sin(azimuth);
    let (real, imaginary) =
        ((shares[0] + shares[1]) * libm::cos(phase), (shares[0] - shares[1]) * libm::sin(phase));
    let g = (k * HALF_WIDTH) * (k * HALF_WIDTH);
    let g = g / (1.0 + g);
    let cabinet = (1.0 + g * libm::cos(polar)) / (1.0 + g);
    (real * real + imaginary * imaginary) * cabinet * cabinet
}

/// 2 J₁(x)/x.
fn piston(x: f64) -> f64 {
    if x.abs() < 1e-9 { 1.0 } else { 2.0 * libm::j1(x) / x }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_in_the_repository_is_the_computed_one() {
        assert!(xtask::workspace::read(FILE).unwrap() == table(), "run `cargo pages loudspeaker`");
    }

    /// A piston's first zero is at ka sin θ = 3.8317, and a small source is omnidirectional.
    #[test]
    fn the_formula_has_its_zero_and_its_limit() {
        assert!(piston(3.831_706).abs() < 1e-6 && (piston(1e-3) - 1.0).abs() < 1e-6);
        assert!((at_frequency(20.0, 0.3, 2.0) - 1.0).abs() < 0.01);
        assert!(at_frequency(8_000.0, 0.0, 3.0) < 1e-3);
    }
}
