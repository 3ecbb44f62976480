//! From fluence to levels.
//!
//! ΣF is an energy echogram summed over time: fluence at the receiver per unit emitted energy [1/m²]
//! (docs/physics.md §1). With a steady source of power level L_W it gives the steady sound pressure level.
//!
//! References: [ISO3382-1] annex A (strength G), [Kuttruff2009] (docs/references.md).

use std::f64::consts::PI;

/// The impedance for which intensity level and sound pressure level coincide: (20 µPa)² / 1 pW [Pa·s/m].
pub const REFERENCE_IMPEDANCE: f64 = 400.0;

/// Sound pressure level L_W + 10 lg(ΣF·1 m²) + 10 lg(ρc/400) [dB re 20 µPa]; −∞ for no energy.
///
/// `fluence_sum` ΣF [1/m²], `source_power_level_db` L_W [dB re 1 pW], `impedance` ρc [Pa·s/m].
pub fn level_db(fluence_sum: f64, source_power_level_db: f64, impedance: f64) -> f64 {
    source_power_level_db
        + energy_to_level_db(fluence_sum)
        + energy_to_level_db(impedance / REFERENCE_IMPEDANCE)
}

/// Strength G, the level relative to the same source in a free field at 10 m: 10 lg(400π ΣF) [dB]; −∞ for no energy.
///
/// `fluence_sum` ΣF [1/m²].
pub fn strength_db(fluence_sum: f64) -> f64 {
    energy_to_level_db(4.0 * PI * 100.0 * fluence_sum)
}

/// 10 lg of a ratio of energies [dB]; −∞ for 0.
pub fn energy_to_level_db(ratio: f64) -> f64 {
    10.0 * libm::log10(ratio)
}

/// The ratio of energies 10^(level/10).
pub fn energy_from_level_db(level_db: f64) -> f64 {
    libm::exp10(level_db / 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_field_at_one_metre_is_eleven_decibels_below_the_power_level() {
        let fluence = 1.0 / (4.0 * PI);
        assert!((level_db(fluence, 90.0, 400.0) - 79.007_901_0).abs() < 1e-6);
        // ρc = 412 Pa·s/m lies 0.128 dB above the reference.
        assert!((level_db(fluence, 90.0, 412.0) - 79.136_273_2).abs() < 1e-6);
    }

    #[test]
    fn strength_is_zero_in_a_free_field_at_ten_metres() {
        assert!(strength_db(1.0 / (4.0 * PI * 100.0)).abs() < 1e-12);
        assert!((strength_db(1.0 / (4.0 * PI)) - 20.0).abs() < 1e-12);
    }

    #[test]
    fn no_energy_has_no_level() {
        assert!(level_db(0.0, 90.0, 412.0) < f64::MIN);
    }

    #[test]
    fn decibels_round_trip() {
        assert!((energy_to_level_db(energy_from_level_db(-37.5)) + 37.5).abs() < 1e-12);
    }
}
