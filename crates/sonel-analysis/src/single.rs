//! What a receiver has one value of: means of parameters over octaves, and quantities that combine bands.

use sonel_acoustics::just_noticeable as noticeable;

use crate::average::single_number;
use crate::estimate::ParameterValue;
use crate::parameter::Parameter;
use crate::receiver::ReceiverParameters;

/// A single number of a source at a receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Single {
    /// Mean over octaves.
    Of(Parameter),
    /// A-weighted level [dB re 20 µPa].
    AWeighted,
    /// Speech transmission index, 0 … 1.
    Speech,
}

impl Single {
    /// What has no bands.
    pub const OF_SEVERAL: [Self; 2] = [Self::AWeighted, Self::Speech];

    /// That of this key or short name, in any case of letters.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let is_named = |single: &Self| {
            [single.key(), single.short_name()].iter().any(|known| known.eq_ignore_ascii_case(name))
        };
        let several = Self::OF_SEVERAL.into_iter();
        several.chain(Parameter::EVERY.map(Self::Of)).find(is_named)
    }

    /// Name in options, such as `t30`.
    #[must_use]
    pub fn short_name(self) -> &'static str {
        match self {
            Self::Of(parameter) => parameter.short_name(),
            Self::AWeighted => "la",
            Self::Speech => "sti",
        }
    }

    /// Key in JSON and CSV.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Of(parameter) => parameter.key(),
            Self::AWeighted => "a_weighted_level_db",
            Self::Speech => "speech_transmission_index",
        }
    }

    /// Symbol, unit and the factor to it.
    #[must_use]
    pub fn heading(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::Of(parameter) => parameter.heading(),
            Self::AWeighted => ("LA", "dB(A)", 1.0),
            Self::Speech => ("STI", "", 1.0),
        }
    }

    /// Symbol and unit.
    #[must_use]
    pub fn label(self) -> String {
        let (symbol, unit, _) = self.heading();
        if unit.is_empty() { symbol.to_owned() } else { format!("{symbol} [{unit}]") }
    }

    /// Its value.
    ///
    /// # Errors
    /// Why there is none.
    pub fn value(self, receiver: &ReceiverParameters) -> ParameterValue {
        match self {
            Self::Of(parameter) => single_number(receiver, parameter),
            Self::AWeighted => receiver.a_weighted_level_db.clone(),
            Self::Speech => receiver.speech_transmission_index.clone(),
        }
    }

    /// The just-noticeable difference about `value`, in its own unit.
    #[must_use]
    pub fn just_noticeable(self, value: f64) -> f64 {
        match self {
            Self::Of(parameter) => parameter.just_noticeable(value),
            Self::AWeighted => noticeable::LEVEL_DB,
            Self::Speech => noticeable::SPEECH_TRANSMISSION_INDEX,
        }
    }
}
