//! Modulation transfer of an echogram, and the speech transmission index.
//!
//! m(F) = |∫ p²(t) e^(−2πiFt) dt| / ∫ p²(t) dt [Schroeder1981], with the echogram exponential within each bin (as the decay
//! curve is), so an ideal decay is met exactly. The index is the indirect method of IEC 60268-16 with the weights of male
//! speech. Without levels it describes the room alone. With the levels of a [`Talk`] the transfer in octave k is times
//! I_k/(I_k + I_noise,k + I_masking,k + I_threshold,k): background noise, masking by the octave below, and the threshold of reception.
//!
//! References: [IEC60268-16], [Schroeder1981] (docs/references.md).

use std::f64::consts::TAU;

use sonel_echogram::provenance::SystemSource;

use crate::decay::DecayCurve;
use crate::octave;

/// Modulation frequencies, 0.63 to 12.5 Hz in third octaves [Hz].
pub const MODULATION_FREQUENCIES: [f64; 14] =
    [0.63, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0, 10.0, 12.5];

/// Octaves of speech, nominal centres [Hz].
pub const SPEECH_OCTAVES: [f64; 7] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];

/// Octave weights α of male speech.
const WEIGHT: [f64; 7] = [0.085, 0.127, 0.230, 0.233, 0.309, 0.224, 0.173];
/// Redundancy β between neighbouring octaves of male speech.
const REDUNDANCY: [f64; 6] = [0.085, 0.078, 0.065, 0.011, 0.047, 0.095];
/// Apparent signal-to-noise ratios beyond ±15 dB make no difference.
const LARGEST_RATIO_DB: f64 = 15.0;

/// Reception threshold of speech in every octave [dB].
const THRESHOLD_DB: [f64; 7] = [46.0, 27.0, 12.0, 6.5, 7.5, 8.0, 12.0];

/// Speech and noise, in the octaves of [`SPEECH_OCTAVES`].
#[derive(Debug, Clone, PartialEq)]
pub struct Talk {
    /// Power levels of the speech [dB re 1 pW]; without, those of the source.
    pub power_level_db: Option<[f64; 7]>,
    /// Levels of the background noise at every receiver [dB re 20 µPa].
    pub noise_level_db: [f64; 7],
}

impl Talk {
    /// By how much speech is louder than a source of `power_level_db` in bands of these `frequencies` [Hz], in every octave of speech [dB]. Each
    /// source of a `system` radiates the speech with its own gain.
    #[must_use]
    pub fn more_than(
        &self,
        frequencies: &[f64],
        power_level_db: &[f64],
        system: &[SystemSource],
    ) -> [f64; 7] {
        let gains: Vec<f64> = system.iter().map(|source| source.gain_db).collect();
        let gain = if gains.is_empty() { 0.0 } else { octave::sum_db(&gains) };
        std::array::from_fn(|k| {
            let bands = octave::bands_of(SPEECH_OCTAVES[k], frequencies);
            let power = bands.map(|bands| {
                octave::sum_db(&bands.iter().map(|&band| power_level_db[band]).collect::<Vec<_>>())
            });
            power.zip(self.power_level_db).map_or(0.0, |(power, speech)| speech[k] + gain - power)
        })
    }
}

/// The part of the modulation in every octave that noise, masking by the octave below and the reception threshold leave, 0 … 1: of speech and
/// noise of these levels [dB re 20 µPa].
#[must_use]
pub fn audible_shares(speech_db: &[f64; 7], noise_db: &[f64; 7]) -> [f64; 7] {
    let intensity = |level: f64| libm::pow(10.0, 0.1 * level);
    let all: [f64; 7] = std::array::from_fn(|k| intensity(speech_db[k]) + intensity(noise_db[k]));
    std::array::from_fn(|k| {
        let masking = k
            .checked_sub(1)
            .map_or(0.0, |below| all[below] * intensity(masking_db(10.0 * libm::log10(all[below]))));
        intensity(speech_db[k]) / (all[k] + masking + intensity(THRESHOLD_DB[k]))
    })
}

/// How far below an octave of `level` [dB] its masking in the octave above is [dB], negative.
fn masking_db(level: f64) -> f64 {
    match level {
        level if level < 63.0 => 0.5 * level - 65.0,
        level if level < 67.0 => 1.8 * level - 146.9,
        level if level < 100.0 => 0.5 * level - 59.8,
        _ => -10.0,
    }
}

/// Number of modulation frequencies.
const COUNT: usize = MODULATION_FREQUENCIES.len();

/// A complex number at every modulation frequency.
#[derive(Debug, Clone, Copy)]
struct Phasors {
    re: [f64; COUNT],
    im: [f64; COUNT],
}

impl Phasors {
    const ZERO: Self = Self { re: [0.0; COUNT], im: [0.0; COUNT] };

    /// e^(−2πiFt) at time t [s].
    fn at(time: f64) -> Self {
        let mut phasors = Self::ZERO;
        for (k, frequency) in MODULATION_FREQUENCIES.into_iter().enumerate() {
            let (sin, cos) = libm::sincos(TAU * frequency * time);
            (phasors.re[k], phasors.im[k]) = (cos, -sin);
        }
        phasors
    }

    /// Adds (a p − b q) κ/(κ + iω): energy that falls from a to b at the rate κ [1/s], at times of the phasors `p` and `q`.
    fn add_exponential(&mut self, a: f64, p: &Self, b: f64, q: &Self, rate: f64) {
        for (k, frequency) in MODULATION_FREQUENCIES.into_iter().enumerate() {
            let (re, im) = (a * p.re[k] - b * q.re[k], a * p.im[k] - b * q.im[k]);
            let x = TAU * frequency / rate;
            let norm = 1.0 / (1.0 + x * x);
            self.re[k] += (re + im * x) * norm;
            self.im[k] += (im - re * x) * norm;
        }
    }

    /// Adds `times` the numbers of `other`.
    fn add(&mut self, other: &Self, times: f64) {
        for k in 0..COUNT {
            self.re[k] += times * other.re[k];
            self.im[k] += times * other.im[k];
        }
    }

    /// Adds energy that is spread evenly over `width` [s] about the middle of the time [s]: its centre, less what a short bin blurs.
    fn add_even(&mut self, energy: f64, middle: f64, width: f64) {
        let centre = Self::at(middle);
        for (k, frequency) in MODULATION_FREQUENCIES.into_iter().enumerate() {
            let half = 0.5 * TAU * frequency * width;
            let blur = if half > 0.0 { libm::sin(half) / half } else { 1.0 };
            self.re[k] += energy * blur * centre.re[k];
            self.im[k] += energy * blur * centre.im[k];
        }
    }
}

/// Phasors at the borders of the curve that was asked for last. Curves of all octaves, and without each batch, share their borders.
#[derive(Debug, Default)]
pub struct Borders {
    times: Vec<f64>,
    phasors: Vec<Phasors>,
}

impl Borders {
    fn of(&mut self, curve: &DecayCurve) -> &[Phasors] {
        let (times, _) = curve.points();
        if self.times != times {
            self.times = times.to_vec();
            self.phasors = self.times.iter().map(|&time| Phasors::at(time)).collect();
        }
        &self.phasors
    }
}

/// Modulation transfer m at each of [`MODULATION_FREQUENCIES`], 0 … 1, of bands with their energies: what is received in an octave, or its
/// thirds, whose echograms are summed by energy.
#[must_use]
pub fn modulation_transfers(bands: &[(&DecayCurve, f64)], borders: &mut Borders) -> [f64; COUNT] {
    let mut all = Phasors::ZERO;
    for &(curve, energy) in bands {
        let phasors = borders.of(curve);
        let mut sum = Phasors::ZERO;
        for (piece, at) in curve.pieces().zip(phasors.windows(2)) {
            if piece.width() <= 0.0 {
                sum.add(&at[0], piece.before - piece.after);
                continue;
            }
            match piece.rate() {
                Some(rate) if rate > 0.0 => {
                    sum.add_exponential(piece.before, &at[0], piece.after, &at[1], rate);
                }
                Some(_) => {}
                None => sum.add_even(piece.before, 0.5 * (piece.begin + piece.end), piece.width()),
            }
        }
        let (tail, end) = (curve.tail(), phasors.last().copied().unwrap_or(Phasors::at(0.0)));
        sum.add_exponential(tail.energy, &end, 0.0, &end, tail.rate);
        all.add(&sum, energy / curve.total());
    }
    let energy: f64 = bands.iter().map(|(_, energy)| energy).sum();
    std::array::from_fn(|k| (libm::hypot(all.re[k], all.im[k]) / energy).min(1.0))
}

/// Modulation transfer index of the `bands` of one octave, the mean transmission index over the modulation frequencies, 0 … 1; `share` of the
/// modulation is left by noise and hearing.
#[must_use]
pub fn transfer_index(bands: &[(&DecayCurve, f64)], borders: &mut Borders, share: f64) -> f64 {
    let transfers = modulation_transfers(bands, borders);
    transfers.iter().map(|transfer| transmission_index(share * transfer)).sum::<f64>() / COUNT as f64
}

/// Transmission index of a modulation transfer, 0 … 1, by way of the apparent signal-to-noise ratio.
fn transmission_index(transfer: f64) -> f64 {
    let ratio_db = 10.0 * libm::log10(transfer / (1.0 - transfer));
    (ratio_db.clamp(-LARGEST_RATIO_DB, LARGEST_RATIO_DB) + LARGEST_RATIO_DB) / (2.0 * LARGEST_RATIO_DB)
}

/// Speech transmission index from the transfer indices of [`SPEECH_OCTAVES`], 0 … 1.
#[must_use]
pub fn speech_transmission_index(transfer_indices: &[f64; 7]) -> f64 {
    let weighted: f64 = WEIGHT.iter().zip(transfer_indices).map(|(weight, index)| weight * index).sum();
    let redundant: f64 = REDUNDANCY
        .iter()
        .zip(transfer_indices.windows(2))
        .map(|(weight, pair)| weight * libm::sqrt(pair[0] * pair[1]))
        .sum();
    (weighted - redundant).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decay::Echogram;

    #[test]
    fn the_weights_of_speech_add_up_to_one() {
        let sum = WEIGHT.iter().sum::<f64>() - REDUNDANCY.iter().sum::<f64>();
        assert!((sum - 1.0).abs() < 1e-12);
        assert!((speech_transmission_index(&[1.0; 7]) - 1.0).abs() < 1e-12);
        // Different octaves: α₁ 0.25 + α₂ 0.81 + α₇ 1 − β₁ 0.45, the other products vanish.
        let index = speech_transmission_index(&[0.25, 0.81, 0.0, 0.0, 0.0, 0.0, 1.0]);
        assert!((index - (0.085 * 0.25 + 0.127 * 0.81 + 0.173 - 0.085 * 0.45)).abs() < 1e-12);
    }

    /// Values of a calculation apart from this code, in Python.
    #[test]
    fn noise_masking_and_threshold_leave_what_the_standard_says() {
        let speech = [62.0, 66.0, 65.0, 58.0, 52.0, 47.0, 101.0];
        let noise = [50.0, 45.0, 48.0, 40.0, 52.0, 20.0, 30.0];
        let expected = [
            0.918_936_394_7,
            0.991_824_491_5,
            0.978_520_346_1,
            0.979_166_931_2,
            0.499_735_303_0,
            0.996_763_338_0,
            0.999_999_919_0,
        ];
        for (found, expected) in audible_shares(&speech, &noise).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
        }
        assert!((masking_db(62.999) - -33.5).abs() < 1e-3 && (masking_db(66.999) - -26.3).abs() < 1e-2);
        assert!((masking_db(67.0) - -26.3).abs() < 1e-9 && (masking_db(99.999) - -9.8).abs() < 1e-3);
    }

    #[test]
    fn the_transmission_index_spans_thirty_decibels() {
        for (transfer, index) in [(0.0, 0.0), (0.5, 0.5), (1.0, 1.0), (10.0 / 11.0, 25.0 / 30.0)] {
            assert!((transmission_index(transfer) - index).abs() < 1e-12, "{transfer}");
        }
    }

    /// Two equal arrivals Δ apart: m = |cos(π F Δ)|, blurred by bins that are short against 1/F.
    #[test]
    fn an_echo_interferes_with_the_modulation() {
        let edges: Vec<f64> = (0..=2000).map(|edge| f64::from(edge) * 1e-4).collect();
        let mut energy = vec![0.0; 2000];
        (energy[0], energy[1000]) = (1.0, 1.0);
        let curve =
            DecayCurve::new(Echogram { edges: &edges, energy: &energy, direct_time: 0.0, arrivals: &[] })
                .unwrap();
        let found = modulation_transfers(&[(&curve, 1.0)], &mut Borders::default());
        for (frequency, found) in MODULATION_FREQUENCIES.into_iter().zip(found) {
            let expected = libm::fabs(libm::cos(std::f64::consts::PI * frequency * 0.1));
            // The arrivals lie anywhere within their bins of 0.1 ms.
            let tolerance = TAU * frequency * 1e-4;
            assert!((found - expected).abs() < tolerance, "{frequency}");
        }
    }
}
