//! The figures of ISO 3382-1 that are read off one band's decay curve.
//!
//! References: [ISO3382-1], annex A (docs/references.md); docs/physics.md §1 for level and strength.

use sonel_acoustics::{just_noticeable as jnd, level_db, strength_db};
use thiserror::Error;

use crate::decay::{DecayCurve, DecayFit, DecayRange, TailRefusal};

/// A figure of one source, receiver and band.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// Sound pressure level of the whole record.
    Level,
    /// Strength G of the whole record.
    Strength,
    /// Early decay time, 0 … −10 dB.
    EarlyDecayTime,
    /// Reverberation time from −5 … −25 dB.
    T20,
    /// Reverberation time from −5 … −35 dB.
    T30,
    /// Early-to-late index at 50 ms.
    ClarityC50,
    /// Early-to-late index at 80 ms.
    ClarityC80,
    /// Early part of the energy at 50 ms, 0…1.
    DefinitionD50,
    /// Centre time.
    CenterTime,
}

impl Parameter {
    /// All of them, in the order of every output.
    pub const ALL: [Self; 9] = [
        Self::Level,
        Self::Strength,
        Self::EarlyDecayTime,
        Self::T20,
        Self::T30,
        Self::ClarityC50,
        Self::ClarityC80,
        Self::DefinitionD50,
        Self::CenterTime,
    ];

    /// Key in JSON and CSV, unit included.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Level => "level_db",
            Self::Strength => "strength_g_db",
            Self::EarlyDecayTime => "early_decay_time_s",
            Self::T20 => "t20_s",
            Self::T30 => "t30_s",
            Self::ClarityC50 => "clarity_c50_db",
            Self::ClarityC80 => "clarity_c80_db",
            Self::DefinitionD50 => "definition_d50",
            Self::CenterTime => "center_time_s",
        }
    }

    /// Symbol of the standard and unit, for the head of a column.
    #[must_use]
    pub fn heading(self) -> &'static str {
        match self {
            Self::Level => "Lp [dB]",
            Self::Strength => "G [dB]",
            Self::EarlyDecayTime => "EDT [s]",
            Self::T20 => "T20 [s]",
            Self::T30 => "T30 [s]",
            Self::ClarityC50 => "C50 [dB]",
            Self::ClarityC80 => "C80 [dB]",
            Self::DefinitionD50 => "D50",
            Self::CenterTime => "Ts [ms]",
        }
    }

    /// Factor from the figure's own unit to the one of its heading.
    #[must_use]
    pub fn heading_scale(self) -> f64 {
        if self == Self::CenterTime { 1000.0 } else { 1.0 }
    }

    /// Just-noticeable difference about `value`, in the figure's unit.
    #[must_use]
    pub fn just_noticeable_difference(self, value: f64) -> f64 {
        match self {
            Self::Level | Self::Strength => jnd::LEVEL_DB,
            Self::EarlyDecayTime => jnd::EARLY_DECAY_TIME * value,
            Self::T20 | Self::T30 => jnd::REVERBERATION_TIME * value,
            Self::ClarityC50 | Self::ClarityC80 => jnd::CLARITY_DB,
            Self::DefinitionD50 => jnd::DEFINITION,
            Self::CenterTime => jnd::CENTER_TIME,
        }
    }

    /// Half-width of an interval beyond which a value means nothing: half of a time, 6 dB (a factor of 4), half of the
    /// range of D50.
    #[must_use]
    pub fn widest_interval(self, value: f64) -> f64 {
        match self {
            Self::EarlyDecayTime | Self::T20 | Self::T30 | Self::CenterTime => 0.5 * value,
            Self::DefinitionD50 => 0.5,
            Self::Level | Self::Strength | Self::ClarityC50 | Self::ClarityC80 => 6.0,
        }
    }

    /// Range of possible values.
    #[must_use]
    pub fn limits(self) -> (f64, f64) {
        match self {
            Self::DefinitionD50 => (0.0, 1.0),
            Self::EarlyDecayTime | Self::T20 | Self::T30 | Self::CenterTime => (0.0, f64::INFINITY),
            Self::Level | Self::Strength | Self::ClarityC50 | Self::ClarityC80 => {
                (f64::NEG_INFINITY, f64::INFINITY)
            }
        }
    }

    fn decay_range(self) -> Option<DecayRange> {
        match self {
            Self::EarlyDecayTime => Some(DecayRange::EARLY),
            Self::T20 => Some(DecayRange::T20),
            Self::T30 => Some(DecayRange::T30),
            _ => None,
        }
    }
}

/// Source level and air, which turn energy into level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelReference {
    /// Power level of the source [dB re 1 pW].
    pub source_power_level_db: f64,
    /// Characteristic impedance ρc of the air [Pa·s/m].
    pub characteristic_impedance: f64,
}

/// Why a decay curve does not support a figure.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Unsupported {
    /// The curve does not fall deep enough.
    #[error(
        "decay range too short: {needed_db:.0} dB needed, {available_db:.1} dB available; simulate a longer duration"
    )]
    DecayRange {
        /// What the figure needs, margin included (dB).
        needed_db: f64,
        /// What the record supports (dB).
        available_db: f64,
    },
    /// The curve falls through the range within two bins: the bins, not the room, would be measured.
    #[error("the curve falls to {to_db:.0} dB within two bins; render with a smaller --bin")]
    CoarseBins {
        /// Lower end of the range (dB).
        to_db: f64,
    },
    /// Too much of the energy may lie beyond the record.
    #[error("{0}")]
    CutOff(TailRefusal),
    /// The record ends before the limit of early energy.
    #[error("the record ends within {limit_ms:.0} ms of the direct sound; simulate a longer duration")]
    LimitBeyondRecord {
        /// Limit of early energy [ms].
        limit_ms: f64,
    },
    /// All the energy is early, or none: the index is infinite.
    #[error("no energy arrives {side} {limit_ms:.0} ms, the index would be infinite")]
    OneSided {
        /// "after" or "before".
        side: &'static str,
        /// Limit of early energy [ms].
        limit_ms: f64,
    },
}

/// Margin kept from the end of a record whose tail is unknown [dB] (ISO 3382-1 5.3.3 asks for as much from the noise).
const MARGIN_DB: f64 = 10.0;
/// Share of the energy in the last quarter of a record without known tail up to which what is missing can be neglected.
const NEGLIGIBLE_END: f64 = 0.01;

impl Parameter {
    /// The figure's value for `curve`.
    ///
    /// # Errors
    /// [`Unsupported`] when the curve does not support it.
    pub fn evaluate(self, curve: &DecayCurve, reference: LevelReference) -> Result<f64, Unsupported> {
        match self {
            Self::Level => {
                let LevelReference { source_power_level_db, characteristic_impedance } = reference;
                Ok(level_db(curve.recorded_energy(), source_power_level_db, characteristic_impedance))
            }
            Self::Strength => Ok(strength_db(curve.recorded_energy())),
            Self::EarlyDecayTime => Ok(decay_fit(curve, DecayRange::EARLY)?.time),
            Self::T20 => Ok(decay_fit(curve, DecayRange::T20)?.time),
            Self::T30 => Ok(decay_fit(curve, DecayRange::T30)?.time),
            Self::ClarityC50 => clarity_db(curve, 50.0),
            Self::ClarityC80 => clarity_db(curve, 80.0),
            Self::DefinitionD50 => {
                let late = late_energy(curve, 50.0)?;
                Ok(1.0 - late / curve.total_energy())
            }
            Self::CenterTime => {
                check_completeness(curve)?;
                Ok(curve.center_time())
            }
        }
    }

    /// The line behind a decay time, where the bins resolve it; none for other figures.
    ///
    /// # Errors
    /// [`Unsupported`] when the curve does not support it.
    pub fn line(self, curve: &DecayCurve) -> Result<Option<DecayFit>, Unsupported> {
        let Some(range) = self.decay_range() else { return Ok(None) };
        let fit = decay_fit(curve, range)?;
        if fit.inner_edges < 2 {
            return Err(Unsupported::CoarseBins { to_db: range.to_db });
        }
        Ok(Some(fit))
    }
}

/// Refuses records that end while much of their energy may still be to come.
///
/// # Errors
/// [`Unsupported::CutOff`].
pub fn check_completeness(curve: &DecayCurve) -> Result<(), Unsupported> {
    match curve.tail() {
        Err(refusal @ (TailRefusal::TooShort { end_share } | TailRefusal::NotDecaying { end_share }))
            if end_share > NEGLIGIBLE_END =>
        {
            Err(Unsupported::CutOff(refusal))
        }
        _ => Ok(()),
    }
}

fn decay_fit(curve: &DecayCurve, range: DecayRange) -> Result<DecayFit, Unsupported> {
    let margin = if curve.tail().is_ok() { 0.0 } else { MARGIN_DB };
    let (needed_db, available_db) = (margin - range.to_db, curve.depth_db());
    if available_db < needed_db {
        return Err(Unsupported::DecayRange { needed_db, available_db });
    }
    curve.fit(range).ok_or(Unsupported::CoarseBins { to_db: range.to_db })
}

fn clarity_db(curve: &DecayCurve, limit_ms: f64) -> Result<f64, Unsupported> {
    let late = late_energy(curve, limit_ms)?;
    let early = curve.total_energy() - late;
    if late <= 0.0 {
        return Err(Unsupported::OneSided { side: "after", limit_ms });
    }
    if early <= 0.0 {
        return Err(Unsupported::OneSided { side: "before", limit_ms });
    }
    Ok(10.0 * libm::log10(early / late))
}

fn late_energy(curve: &DecayCurve, limit_ms: f64) -> Result<f64, Unsupported> {
    check_completeness(curve)?;
    let limit = limit_ms / 1000.0;
    if curve.end() < limit {
        return Err(Unsupported::LimitBeyondRecord { limit_ms });
    }
    Ok(curve.energy_after(limit))
}
