//! Bands in which single modes of the room decide, and how far they spread levels and decays from place to place.
//!
//! Below f = 2000 √(T/V) fewer than three modes overlap at any frequency: energies know nothing of them, nor do their intervals.
//!
//! - Levels: e² = 1/(1 + 0.238 B T) [Schroeder1969] is the relative variance of the energy where the N modes of a band of width B interfere. Of
//!   modes alone each has x = Σψ⁴/(Σψ²)² = 3/2 per axis that it has waves along, over places of the source and again over those of the
//!   receiver, and brings x (x − 1)/N². Both add up; the level has 4.34 e √(1 + 0.645 e²) dB, 5.57 dB at e = 1. Modes are counted as those
//!   of a cube [Kuttruff2009].
//! - Decays: 0.88/√(B T) of T20, 0.55/√(B T) of T30 [ISO3382-2].
//!
//! Levels of 14 bands of bare boxes (19 … 867 m³, modes summed up) have 0.7 to 1.4 times the former below the Schroeder frequency.
//!
//! References: docs/references.md [Schroeder1962].

use std::f64::consts::PI;
use std::fmt;

use serde_json::{Value, json};
use sonel_acoustics::schroeder_frequency;

use crate::parameter::Parameter;
use crate::receiver::ReceiverParameters;

/// Speed of sound [m/s], as the factor 2000 has it.
const SPEED: f64 = 343.0;

/// Bands below the Schroeder frequency of a room.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalBands {
    /// The bands, ascending; at least one.
    pub bands: Vec<ModalBand>,
    /// The highest Schroeder frequency of these bands [Hz].
    pub schroeder_frequency_hz: f64,
}

/// Standard deviations between places in a band, which no interval holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModalBand {
    /// Nominal centre [Hz].
    pub center_frequency_hz: f64,
    /// Of levels [dB].
    pub level_db: f64,
    /// Of T30, of itself [1]; T20 has 1.6 times as much.
    pub decay: f64,
}

impl ModalBand {
    /// Of a room of `volume` [m³] and `time` [s], in a band of a share `width` of its centre.
    #[must_use]
    pub fn of(volume: f64, time: f64, center_frequency_hz: f64, width: f64) -> Self {
        let (f, bandwidth) = (center_frequency_hz, width * center_frequency_hz);
        let wave = f * libm::cbrt(volume) / SPEED;
        // Modes per hertz of a cube, times its side over c: oblique, tangential and axial ones.
        let [tangential, axial] = [(6.0 * PI * wave - 6.0).max(0.0), 6.0];
        let oblique = (4.0 * PI * wave * wave - 3.0 * PI * wave + 1.5).max(0.0);
        let per_hertz = libm::cbrt(volume) / SPEED * bandwidth;
        let (all, square) = (oblique + tangential + axial, |x: f64| x * (x - 1.0));
        let modes = square(27.0 / 8.0) * oblique + square(9.0 / 4.0) * tangential + square(1.5) * axial;
        let variance = 1.0 / (1.0 + 0.238 * bandwidth * time) + modes / (all * all * per_hertz);
        let level_db = 4.34 * (variance * (1.0 + 0.645 * variance)).sqrt();
        Self { center_frequency_hz, level_db, decay: 0.55 / (bandwidth * time).sqrt() }
    }
}

impl ModalBands {
    /// The bands of `parameters` whose centre is below the Schroeder frequency of their own T20, where it is refused EDT, the mean of all
    /// receivers, in a room of `volume` [m³]; [`None`] where there is no such band. Bands without either are left out.
    #[must_use]
    pub fn of(parameters: &[ReceiverParameters], volume: f64) -> Option<Self> {
        let centers: Vec<f64> =
            parameters.first()?.bands.iter().map(|band| band.center_frequency_hz).collect();
        let is_narrow = centers.windows(2).any(|pair| pair[1] < 1.5 * pair[0]);
        let width = if is_narrow { 0.232 } else { std::f64::consts::FRAC_1_SQRT_2 };
        let mean = |b: usize, parameter: Parameter| {
            let found = parameters.iter().filter_map(|of| of.bands[b].parameter(parameter).as_ref().ok());
            let (sum, count) = found.fold((0.0, 0.0), |(sum, n), time| (sum + time.value, n + 1.0));
            (count > 0.0).then(|| sum / count)
        };
        let below = centers.iter().enumerate().filter_map(|(b, &center)| {
            let time = mean(b, Parameter::T20).or_else(|| mean(b, Parameter::EarlyDecayTime))?;
            let limit = schroeder_frequency(time, volume);
            (center < limit).then(|| (ModalBand::of(volume, time, center, width), limit))
        });
        let (bands, limits): (Vec<_>, Vec<_>) = below.unzip();
        let schroeder_frequency_hz = limits.into_iter().reduce(f64::max)?;
        Some(Self { bands, schroeder_frequency_hz })
    }
}

impl ModalBands {
    /// Level [dB] and share of T30 by band.
    #[must_use]
    pub fn json(&self) -> Value {
        let spread = |band: &ModalBand| json!({ "center_frequency_hz": band.center_frequency_hz, "level_db": band.level_db, "t30": band.decay });
        self.bands.iter().map(spread).collect()
    }
}

impl fmt::Display for ModalBands {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let centers: Vec<String> =
            self.bands.iter().map(|band| band.center_frequency_hz.to_string()).collect();
        let verb = if centers.len() == 1 { "is" } else { "are" };
        let spread = |band: &ModalBand| format!("{:.1} dB and {:.0} %", band.level_db, 100.0 * band.decay);
        let spreads: Vec<String> = self.bands.iter().map(spread).collect();
        write!(
            f,
            "{} Hz {verb} below the Schroeder frequency ({:.0} Hz): single modes dominate there; from place to place levels and T30 have standard deviations of about {}, which intervals do not include",
            centers.join(", "),
            self.schroeder_frequency_hz,
            spreads.join(", ")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A band of a mode or two varies by several decibels, one of very many as broad noise does.
    #[test]
    fn the_fewer_modes_the_more_places_differ() {
        let few = ModalBand::of(19.0, 0.6, 63.0, 0.707);
        assert!((few.level_db - 3.9).abs() < 0.1, "{few:?}");
        let many = ModalBand::of(20_000.0, 2.0, 1000.0, 0.707);
        let interference = 4.34 / (1.0_f64 + 0.238 * 707.0 * 2.0).sqrt();
        assert!((many.level_db / interference - 1.0).abs() < 0.02, "{many:?}");
        assert!(ModalBand::of(190.0, 0.6, 63.0, 0.707).level_db < few.level_db - 1.0);
    }
}
