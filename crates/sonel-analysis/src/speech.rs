//! Speech transmission index from energy decay curves, without noise.
//!
//! The modulation transfer of each octave 125 … 8000 Hz at 14 modulation frequencies is that of its decay curve; apparent
//! signal-to-noise ratios are limited to ±15 dB, averaged per octave and weighted for male speech with the redundancy
//! corrections between neighbours. Noise, the level-dependent masking and the threshold of hearing are left out: the index is
//! that of the room alone at a comfortable level.
//!
//! References: [IEC60268-16], [Schroeder1981] (docs/references.md).

use crate::decay::DecayCurve;

/// Octave centres the index needs [Hz].
pub const OCTAVES_HZ: [f64; 7] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];

/// Modulation frequencies, third octaves [Hz].
const MODULATION_HZ: [f64; 14] = [0.63, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0, 10.0, 12.5];

/// Weights α of the octaves, male speech.
const WEIGHT: [f64; 7] = [0.085, 0.127, 0.230, 0.233, 0.309, 0.224, 0.173];

/// Redundancies β between an octave and the next, male speech.
const REDUNDANCY: [f64; 6] = [0.085, 0.078, 0.065, 0.011, 0.047, 0.095];

/// Limit of the apparent signal-to-noise ratio [dB].
const LIMIT_DB: f64 = 15.0;

/// The index, 0…1, from the decay curves of [`OCTAVES_HZ`].
#[must_use]
pub fn speech_transmission_index(octaves: [&DecayCurve; 7]) -> f64 {
    index(octaves.map(|curve| {
        let transfers = MODULATION_HZ.map(|frequency| transfer_index(curve.modulation_transfer(frequency)));
        transfers.iter().sum::<f64>() / MODULATION_HZ.len() as f64
    }))
}

/// Weighted sum of the octaves' modulation transfer indices.
fn index(octaves: [f64; 7]) -> f64 {
    let weighted: f64 = octaves.iter().zip(WEIGHT).map(|(octave, weight)| weight * octave).sum();
    let redundant: f64 =
        octaves.windows(2).zip(REDUNDANCY).map(|(pair, weight)| weight * (pair[0] * pair[1]).sqrt()).sum();
    (weighted - redundant).clamp(0.0, 1.0)
}

/// Transmission index of a modulation transfer m, 0…1.
fn transfer_index(m: f64) -> f64 {
    let ratio_db = (10.0 * libm::log10(m / (1.0 - m))).clamp(-LIMIT_DB, LIMIT_DB);
    (ratio_db + LIMIT_DB) / (2.0 * LIMIT_DB)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_octaves_have_their_own_index() {
        // Σα − Σβ = 1: an index that is the same in all octaves is that of the whole.
        for octave in [0.0, 0.3, 1.0] {
            assert!((index([octave; 7]) - octave).abs() < 1e-12);
        }
        assert!((index([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]) - 0.085).abs() < 1e-12);
    }

    #[test]
    fn transfers_are_limited_at_fifteen_decibels() {
        assert!((transfer_index(0.5) - 0.5).abs() < 1e-12);
        assert!((transfer_index(1.0) - 1.0).abs() < 1e-12);
        assert!(transfer_index(0.0).abs() < 1e-12);
        assert!((transfer_index(10.0 / 11.0) - 25.0 / 30.0).abs() < 1e-12);
    }
}
