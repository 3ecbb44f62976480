//! The parameters of one echogram.
//!
//! Level and strength are those of the recorded energy, 10 lg of ΣF as docs/physics.md §1 writes them; everything else is
//! read off the decay curve, which continues beyond the record.
//!
//! References: [ISO3382-1] annex A (docs/references.md).

use sonel_acoustics::just_noticeable as noticeable;
use sonel_acoustics::{level_db, strength_db};

use crate::decay::{DecayCurve, Echogram};
use crate::estimate::{DecayQuality, Unsupported};
use crate::regression::{self, DecayLine, DecayRange};

/// A parameter of ISO 3382-1 per band.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// Sound pressure level [dB re 20 µPa].
    Level,
    /// Strength G [dB].
    Strength,
    /// Early decay time [s].
    EarlyDecayTime,
    /// T20 [s].
    T20,
    /// T30 [s].
    T30,
    /// Clarity C50 [dB].
    ClarityC50,
    /// Clarity C80 [dB].
    ClarityC80,
    /// Definition D50, 0 … 1.
    DefinitionD50,
    /// Centre time Ts [s].
    CenterTime,
    /// Early lateral energy fraction LF, 0 … 1.
    LateralFraction,
    /// Early lateral energy fraction LFC, with the cosine of the angle in place of its square, 0 … 1.
    LateralFractionCosine,
    /// Late lateral level L_J [dB].
    LateLateralLevel,
    /// Early stage support ST_early [dB].
    SupportEarly,
    /// Late stage support ST_late [dB].
    SupportLate,
    /// Useful-to-detrimental ratio U50 [dB]: speech of the first 50 ms over later speech and noise.
    UsefulToDetrimental,
    /// Level of speech over that of the noise [dB].
    SignalToNoise,
    /// Direct sound over everything else [dB].
    DirectToReverberant,
}

/// Names of a parameter, and how its value is written.
struct Names {
    /// Key in JSON and CSV.
    key: &'static str,
    /// Name in options.
    short: &'static str,
    /// Symbol of the standard.
    symbol: &'static str,
    /// Unit of outputs.
    unit: &'static str,
    /// Just-noticeable difference, relative where [`Parameter::is_noticed_relatively`].
    noticeable: f64,
}

/// Number of parameters per band that every response has.
pub const PARAMETER_COUNT: usize = 9;

impl Parameter {
    /// Every parameter, also those that only some responses have.
    pub const EVERY: [Self; 17] = [
        Self::Level,
        Self::Strength,
        Self::EarlyDecayTime,
        Self::T20,
        Self::T30,
        Self::ClarityC50,
        Self::ClarityC80,
        Self::DefinitionD50,
        Self::CenterTime,
        Self::LateralFraction,
        Self::LateralFractionCosine,
        Self::LateLateralLevel,
        Self::SupportEarly,
        Self::SupportLate,
        Self::UsefulToDetrimental,
        Self::SignalToNoise,
        Self::DirectToReverberant,
    ];

    /// Parameters of every response, in the order of every output: the first of [`Self::EVERY`].
    pub const ALL: [Self; PARAMETER_COUNT] =
        *Self::EVERY.first_chunk().expect("every response has fewer parameters than there are");

    /// Parameters of responses with directions, besides.
    pub const LATERAL: [Self; 3] =
        [Self::LateralFraction, Self::LateralFractionCosine, Self::LateLateralLevel];

    /// Parameters of a receiver one metre from the source, besides, with their windows since the direct sound [s].
    pub const SUPPORT: [(Self, [f64; 2]); 2] =
        [(Self::SupportEarly, [0.020, 0.100]), (Self::SupportLate, [0.100, 1.000])];

    /// Parameters of speech in noise, besides.
    pub const IN_NOISE: [Self; 2] = [Self::UsefulToDetrimental, Self::SignalToNoise];

    /// The table of all parameters. Just-noticeable differences of L_J, support, U50 and ratios of direct sound are not known: they are taken
    /// for those of levels and of clarity.
    fn names(self) -> Names {
        let row = |key, short, symbol, unit, noticeable| Names { key, short, symbol, unit, noticeable };
        match self {
            Self::Level => row("level_db", "level", "L", "dB", noticeable::LEVEL_DB),
            Self::Strength => row("strength_g_db", "g", "G", "dB", noticeable::LEVEL_DB),
            Self::EarlyDecayTime => {
                row("early_decay_time_s", "edt", "EDT", "s", noticeable::EARLY_DECAY_TIME)
            }
            Self::T20 => row("t20_s", "t20", "T20", "s", noticeable::REVERBERATION_TIME),
            Self::T30 => row("t30_s", "t30", "T30", "s", noticeable::REVERBERATION_TIME),
            Self::ClarityC50 => row("clarity_c50_db", "c50", "C50", "dB", noticeable::CLARITY_DB),
            Self::ClarityC80 => row("clarity_c80_db", "c80", "C80", "dB", noticeable::CLARITY_DB),
            Self::DefinitionD50 => row("definition_d50", "d50", "D50", "%", noticeable::DEFINITION),
            Self::CenterTime => row("center_time_s", "ts", "Ts", "ms", noticeable::CENTER_TIME),
            Self::LateralFraction => row("lateral_fraction", "lf", "LF", "%", noticeable::LATERAL_FRACTION),
            Self::LateralFractionCosine => {
                row("lateral_fraction_cosine", "lfc", "LFC", "%", noticeable::LATERAL_FRACTION)
            }
            Self::LateLateralLevel => row("late_lateral_level_db", "lj", "LJ", "dB", noticeable::LEVEL_DB),
            Self::SupportEarly => row("support_early_db", "stearly", "STearly", "dB", noticeable::LEVEL_DB),
            Self::SupportLate => row("support_late_db", "stlate", "STlate", "dB", noticeable::LEVEL_DB),
            Self::UsefulToDetrimental => {
                row("useful_to_detrimental_u50_db", "u50", "U50", "dB", noticeable::CLARITY_DB)
            }
            Self::SignalToNoise => row("signal_to_noise_db", "snr", "SNR", "dB", noticeable::LEVEL_DB),
            Self::DirectToReverberant => {
                row("direct_to_reverberant_db", "drr", "DRR", "dB", noticeable::CLARITY_DB)
            }
        }
    }

    /// The parameter of this key or short name, in any case of letters.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let is_named =
            |names: Names| [names.key, names.short].iter().any(|known| known.eq_ignore_ascii_case(name));
        Self::EVERY.into_iter().find(|parameter| is_named(parameter.names()))
    }

    /// Name in options, such as `t30`.
    #[must_use]
    pub fn short_name(self) -> &'static str {
        self.names().short
    }

    /// A limit of its interval as options take it, such as `1%`.
    #[must_use]
    pub fn example_of_limit(self) -> &'static str {
        match self.names().unit {
            "dB" => "0.1dB",
            "ms" => "2ms",
            _ => "1%",
        }
    }

    /// Key in JSON and CSV.
    #[must_use]
    pub fn key(self) -> &'static str {
        self.names().key
    }

    /// The just-noticeable difference about `value`, in its own unit.
    #[must_use]
    pub fn just_noticeable(self, value: f64) -> f64 {
        let noticeable = self.names().noticeable;
        if self.is_noticed_relatively() { noticeable * value } else { noticeable }
    }

    /// Whether [`Self::just_noticeable`] is a part of the value.
    #[must_use]
    pub fn is_noticed_relatively(self) -> bool {
        matches!(self, Self::EarlyDecayTime | Self::T20 | Self::T30)
    }

    /// Whether it is a time, which falls about as the reciprocal of the absorption.
    #[must_use]
    pub fn is_time(self) -> bool {
        self.is_noticed_relatively() || self == Self::CenterTime
    }

    /// Whether it is a ratio of early to late energy in decibels.
    #[must_use]
    pub fn is_clarity(self) -> bool {
        matches!(self, Self::ClarityC50 | Self::ClarityC80)
    }

    /// Its symbol and unit as the head of a column, and the factor from its own unit to that one.
    #[must_use]
    pub fn heading(self) -> (&'static str, &'static str, f64) {
        let Names { symbol, unit, .. } = self.names();
        let factor = match unit {
            "%" => 100.0,
            "ms" => 1000.0,
            _ => 1.0,
        };
        (symbol, unit, factor)
    }
}

/// Constants that turn energy into levels, which a measurement that is not calibrated lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelScale {
    /// Power level of the source [dB re 1 pW].
    pub source_power_level_db: f64,
    /// ρc [Pa s/m].
    pub characteristic_impedance: f64,
}

/// What the parameters of one echogram are read off, each when it is asked for.
#[derive(Debug, Clone)]
pub struct Values {
    /// Energy of the record.
    total: f64,
    scale: Option<LevelScale>,
    /// The decay curve.
    pub curve: Result<DecayCurve, Unsupported>,
}

impl Values {
    /// Integrates `echogram`.
    #[must_use]
    pub fn read(echogram: Echogram<'_>, scale: Option<LevelScale>) -> Self {
        Self::of_curve(echogram.total(), DecayCurve::new(echogram), scale)
    }

    /// A record of energy `total` with `curve`.
    #[must_use]
    pub fn of_curve(total: f64, curve: Result<DecayCurve, Unsupported>, scale: Option<LevelScale>) -> Self {
        Self { total, scale, curve }
    }

    /// One of [`Parameter::ALL`].
    ///
    /// # Errors
    /// Why there is no such value.
    pub fn value(&self, parameter: Parameter) -> Result<f64, Unsupported> {
        match parameter {
            Parameter::Level | Parameter::Strength => self.level(parameter),
            Parameter::ClarityC50 => clarity(self.curve()?, 0.050),
            Parameter::ClarityC80 => clarity(self.curve()?, 0.080),
            Parameter::DefinitionD50 => Ok(1.0 - late(self.curve()?, 0.050)? / self.curve()?.total()),
            Parameter::CenterTime => center_time(self.curve()?),
            _ => Ok(self.line(parameter).unwrap_or(Err(Unsupported::NotAsked))?.time),
        }
    }

    fn level(&self, parameter: Parameter) -> Result<f64, Unsupported> {
        let scale = self.scale.ok_or(Unsupported::NotCalibrated)?;
        if self.total <= 0.0 {
            let is_outside = |reason: &&Unsupported| matches!(reason, Unsupported::DirectOutside { .. });
            return Err(self
                .curve
                .as_ref()
                .err()
                .filter(is_outside)
                .cloned()
                .unwrap_or(Unsupported::NoEnergy));
        }
        let LevelScale { source_power_level_db, characteristic_impedance } = scale;
        Ok(match parameter {
            Parameter::Level => level_db(self.total, source_power_level_db, characteristic_impedance),
            _ => strength_db(self.total),
        })
    }

    /// The line of a reverberation time; none for other parameters.
    fn line(&self, parameter: Parameter) -> Option<Result<DecayLine, Unsupported>> {
        let range = match parameter {
            Parameter::EarlyDecayTime => DecayRange::EARLY,
            Parameter::T20 => DecayRange::T20,
            Parameter::T30 => DecayRange::T30,
            _ => return None,
        };
        Some(self.curve().and_then(|curve| regression::fit(curve, range)))
    }

    /// The decay curve.
    ///
    /// # Errors
    /// Why there is none.
    pub fn curve(&self) -> Result<&DecayCurve, Unsupported> {
        self.curve.as_ref().map_err(Clone::clone)
    }

    /// Reading of a reverberation time; none for other parameters.
    #[must_use]
    pub fn quality(&self, parameter: Parameter) -> Option<DecayQuality> {
        let DecayLine { range, non_linearity_permille, .. } = self.line(parameter)?.ok()?;
        let later = |parameter| self.line(parameter)?.ok();
        let ratio = || Some(later(Parameter::T30)?.time / later(Parameter::T20)?.time);
        let is_early = parameter == Parameter::EarlyDecayTime;
        Some(DecayQuality {
            range_db: [range.from_db, range.to_db],
            non_linearity_permille,
            curvature_percent: if is_early { None } else { ratio().map(|ratio| 100.0 * (ratio - 1.0)) },
        })
    }
}

/// Bins before a limit between early and late, at the least. Within a bin the energy counts as that of an exponential decay: of bins of
/// 12.5 ms 6.25 ms may be on the wrong side of 50 ms, 0.75 dB of the late energy at T = 0.5 s.
const BINS_BEFORE_LIMIT: f64 = 4.0;
/// Share of a bin's width that is rounding [1]: borders are sums of up to a million widths.
const ROUNDING: f64 = 1e-9;

/// Energy at `limit` [s] after the direct sound and later.
pub(crate) fn late(curve: &DecayCurve, limit: f64) -> Result<f64, Unsupported> {
    let most = limit / BINS_BEFORE_LIMIT;
    let next = curve.borders().partition_point(|&border| border <= limit);
    if let (Some(&before), Some(&after)) =
        (curve.borders().get(next.wrapping_sub(1)), curve.borders().get(next))
        && 2.0 * (limit - before).min(after - limit) > most * (1.0 + ROUNDING)
    {
        return Err(too_wide(after - before, most));
    }
    curve.remaining(limit).ok_or(Unsupported::LimitOutside { limit_ms: 1000.0 * limit })
}

/// Ts [s]: the first bin spreads over its width what is not listed.
fn center_time(curve: &DecayCurve) -> Result<f64, Unsupported> {
    let width = curve.borders().get(1).copied().unwrap_or(0.0);
    if width > noticeable::CENTER_TIME * (1.0 + ROUNDING) {
        return Err(too_wide(width, noticeable::CENTER_TIME));
    }
    Ok(curve.center_time())
}

fn too_wide(width: f64, most: f64) -> Unsupported {
    Unsupported::BinTooWide { width_ms: 1000.0 * width, most_ms: 1000.0 * most }
}

/// Early-to-late index with the given limit [s]: 10 lg(early / late) [dB].
fn clarity(curve: &DecayCurve, limit: f64) -> Result<f64, Unsupported> {
    let limit_ms = 1000.0 * limit;
    let late = late(curve, limit)?;
    let early = curve.total() - late;
    if early <= 0.0 {
        return Err(Unsupported::NothingEarly { limit_ms });
    }
    let ratio_db = 10.0 * libm::log10(early / late);
    if ratio_db.is_finite() { Ok(ratio_db) } else { Err(Unsupported::NothingLate { limit_ms }) }
}

#[cfg(test)]
mod tests;
