//! Lateral energy: the fractions LF and LFC and the late lateral level L_J, from the decay curves of energy, lateral energy (cos² of the angle
//! to the lateral axis) and lateral cross energy (|cos|).
//!
//! LF = ∫₅⁸⁰ p_L² dt / ∫₀⁸⁰ p² dt, LFC = ∫₅⁸⁰ |p_L p| dt / ∫₀⁸⁰ p² dt, L_J = 10 lg(∫₈₀^∞ p_L² dt / ∫ p₁₀² dt), times in milliseconds since
//! the direct sound, p₁₀ its pressure at 10 m in a free field. The figure-of-eight microphone p_L is as sensitive on its axis as the
//! omnidirectional one. In a diffuse field LF is 1/3 of the early energy after 5 ms, LFC one half.
//!
//! References: [ISO3382-1] annex A (docs/references.md).

use sonel_acoustics::strength_db;

use crate::estimate::Unsupported;
use crate::parameter::{Values, late};

/// Lateral sound counts from here on: the direct sound and what the floor returns at once do not [s].
const BEGIN: f64 = 0.005;
/// End of early sound [s].
const END: f64 = 0.080;

/// The part of the early energy that `lateral` is of `all`: LF or LFC.
///
/// # Errors
/// When one of them has no curve, the record ends before 80 ms, or nothing arrives early.
pub(crate) fn early_fraction(all: &Values, lateral: &Values) -> Result<f64, Unsupported> {
    let (all, lateral) = (all.curve()?, lateral.curve()?);
    let early = all.total() - late(all, END)?;
    if early <= 0.0 {
        return Err(Unsupported::NothingEarly { limit_ms: 1000.0 * END });
    }
    Ok((late(lateral, BEGIN)? - late(lateral, END)?) / early)
}

/// L_J [dB].
///
/// # Errors
/// When there is no curve, the record ends before 80 ms, or nothing arrives late.
pub(crate) fn late_level_db(lateral: &Values) -> Result<f64, Unsupported> {
    let late = late(lateral.curve()?, END)?;
    if late > 0.0 { Ok(strength_db(late)) } else { Err(Unsupported::NothingLate { limit_ms: 1000.0 * END }) }
}
