//! Stage support: energy that the room returns to one metre from the source.
//!
//! ST_early = 10 lg(E₂₀₋₁₀₀ / E₀₋₁₀), ST_late = 10 lg(E₁₀₀₋₁₀₀₀ / E₀₋₁₀), E the energy between two times in milliseconds since the direct sound.
//!
//! References: [ISO3382-1] annex C (docs/references.md).

use crate::estimate::Unsupported;
use crate::parameter::{Values, late};

/// Distance at which support is defined [m].
const DISTANCE: f64 = 1.0;
/// So far off a receiver may stand [m]: 0.4 dB of the direct sound.
const TOLERANCE: f64 = 0.05;
/// End of the direct sound, which serves as reference [s].
const DIRECT_END: f64 = 0.010;

/// Whether support is defined for a receiver so far from the source [m].
#[must_use]
pub(crate) fn is_defined(distance: f64) -> bool {
    (distance - DISTANCE).abs() <= TOLERANCE
}

/// Energy between `begin` and `end` [s] over that of the direct sound [dB].
///
/// # Errors
/// When there is no curve, the record ends before `end`, or there is nothing in one of the windows.
pub(crate) fn support_db(values: &Values, [begin, end]: [f64; 2]) -> Result<f64, Unsupported> {
    let curve = values.curve()?;
    let direct = curve.total() - late(curve, DIRECT_END)?;
    let returned = late(curve, begin)? - late(curve, end)?;
    if direct <= 0.0 {
        return Err(Unsupported::NothingEarly { limit_ms: 1000.0 * DIRECT_END });
    }
    if returned <= 0.0 {
        return Err(Unsupported::NothingLate { limit_ms: 1000.0 * begin });
    }
    Ok(10.0 * libm::log10(returned / direct))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parameter;
    use crate::decay::Echogram;
    use crate::parameter::LevelScale;
    use sonel_testkit::exponential::ExponentialDecay;

    const SCALE: Option<LevelScale> =
        Some(LevelScale { source_power_level_db: 90.0, characteristic_impedance: 412.0 });

    /// Direct sound of energy 2 and a decay behind it: both in closed form.
    #[test]
    fn support_is_the_energy_of_its_windows() {
        let decay = ExponentialDecay { reverberation_time: 1.3, energy: 0.1 };
        let edges: Vec<f64> = (0..=2000).map(|edge| f64::from(edge) * 0.001).collect();
        let mut energy = decay.bins(0.001, 2000);
        energy[0] += 2.0;
        let values =
            Values::read(Echogram { edges: &edges, energy: &energy, direct_time: 0.0, arrivals: &[] }, SCALE);
        for (parameter, [begin, end]) in Parameter::SUPPORT {
            let expected = decay.energy_between(begin, end) / (2.0 + decay.energy_between(0.0, DIRECT_END));
            let found = support_db(&values, [begin, end]).unwrap();
            assert!((found - 10.0 * libm::log10(expected)).abs() < 1e-9, "{parameter:?}: {found}");
        }
        let short = Values::read(
            Echogram { edges: &edges[..901], energy: &energy[..900], direct_time: 0.0, arrivals: &[] },
            SCALE,
        );
        let late = support_db(&short, Parameter::SUPPORT[1].1);
        assert_eq!(late, Err(Unsupported::LimitOutside { limit_ms: 1000.0 }));
    }

    #[test]
    fn support_is_defined_one_metre_from_the_source() {
        assert!(is_defined(1.0) && is_defined(0.96) && !is_defined(1.1) && !is_defined(0.5));
    }
}
