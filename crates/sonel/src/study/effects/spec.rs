//! `--effects SPEC`: `auto`, `all` or `none`, then changes in order: `auto,-air,+directivity`. `all` is everything that the scene has: a scene
//! that states no attenuation by air gets it by `+air` only. `auto:1` leaves out what changes less than 1 just-noticeable difference instead of
//! a tenth.

use std::str::FromStr;

use thiserror::Error;

use super::{Effect, THRESHOLD};

/// A specification that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum EffectSpecError {
    /// The first word is none of the three bases.
    #[error("effects begin with auto, all or none, not with \"{0}\" (example: auto,-air)")]
    Base(String),
    /// A threshold that is none.
    #[error(
        "\"{0}\" is not a threshold: write auto:X, X a number above 0 in just-noticeable differences, such as auto:0.5"
    )]
    Threshold(String),
    /// A change without a sign.
    #[error("\"{0}\" has no sign: write +{0} to add or -{0} to remove the effect")]
    Sign(String),
    /// No such effect.
    #[error(
        "unknown effect \"{0}\": choose among diffraction, boundary, transmission, refraction, air, directivity"
    )]
    Unknown(String),
}

/// Request for an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Request {
    /// To be decided.
    Auto,
    /// On as far as the scene has it.
    Scene,
    /// On, whatever the scene says.
    On,
    /// Off.
    Off,
}

/// Requests of the user.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectSpec {
    requests: [Request; 6],
    threshold: f64,
    names_rendered: bool,
}

impl Default for EffectSpec {
    fn default() -> Self {
        Self { requests: [Request::Auto; 6], threshold: THRESHOLD, names_rendered: false }
    }
}

impl EffectSpec {
    /// Effects that a map of [`sonel_map::Mode::Accurate`] does not depend on.
    pub const RENDERED: [Effect; 2] = [Effect::Diffraction, Effect::Boundary];

    /// Effects are on where leaving them out would change a level or reverberation time by more than a tenth of a just-noticeable
    /// difference; the default.
    #[must_use]
    pub fn auto() -> Self {
        Self::default()
    }

    /// Every effect that the scene has is on.
    #[must_use]
    pub fn all() -> Self {
        Self { requests: [Request::Scene; 6], ..Self::default() }
    }

    /// No effect is on.
    #[must_use]
    pub fn none() -> Self {
        Self { requests: [Request::Off; 6], ..Self::default() }
    }

    /// Switches `effect` on.
    #[must_use]
    pub fn with(self, effect: Effect) -> Self {
        self.requested(effect, Request::On)
    }

    /// Switches `effect` off.
    #[must_use]
    pub fn without(self, effect: Effect) -> Self {
        self.requested(effect, Request::Off)
    }

    fn requested(mut self, effect: Effect, request: Request) -> Self {
        self.requests[effect as usize] = request;
        self.names_rendered |= Self::RENDERED.contains(&effect);
        self
    }

    /// Leaves out, where [`Self::auto`] decides, what changes less than this many just-noticeable differences, a number above 0.
    ///
    /// # Errors
    /// When `just_noticeable` is no such number.
    pub fn with_threshold(self, just_noticeable: f64) -> Result<Self, EffectSpecError> {
        match just_noticeable {
            number if number.is_finite() && number > 0.0 => Ok(Self { threshold: number, ..self }),
            other => Err(EffectSpecError::Threshold(other.to_string())),
        }
    }

    /// Request for `effect`.
    pub(super) fn request(&self, effect: Effect) -> Request {
        self.requests[effect as usize]
    }

    /// Whether edges diffract in rendering.
    #[must_use]
    pub fn diffracts(&self) -> bool {
        self.request(Effect::Diffraction) != Request::Off
    }

    /// Whether a change, by + or −, names one of [`Self::RENDERED`].
    #[must_use]
    pub fn names_rendered(&self) -> bool {
        self.names_rendered
    }

    /// Just-noticeable differences below which `auto` leaves an effect out.
    pub(super) fn threshold(&self) -> f64 {
        self.threshold
    }
}

impl FromStr for EffectSpec {
    type Err = EffectSpecError;

    fn from_str(text: &str) -> Result<Self, EffectSpecError> {
        let mut words = text.split(',').map(str::trim);
        let mut spec = match words.next().unwrap_or_default() {
            "auto" => Self::auto(),
            "all" => Self::all(),
            "none" => Self::none(),
            other => match other.strip_prefix("auto:").map(|text| (text, text.parse())) {
                Some((_, Ok(threshold))) => Self::auto().with_threshold(threshold)?,
                Some((text, Err(_))) => return Err(EffectSpecError::Threshold(text.to_owned())),
                None => return Err(EffectSpecError::Base(other.to_owned())),
            },
        };
        for word in words {
            let (request, name) = match (word.strip_prefix('+'), word.strip_prefix('-')) {
                (Some(name), _) => (Request::On, name),
                (_, Some(name)) => (Request::Off, name),
                _ => return Err(EffectSpecError::Sign(word.to_owned())),
            };
            let effect = Effect::ALL.into_iter().find(|effect| effect.name() == name);
            spec = spec.requested(effect.ok_or_else(|| EffectSpecError::Unknown(name.to_owned()))?, request);
        }
        Ok(spec)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specifications_are_read_in_order() {
        let spec: EffectSpec = "auto,-air,+diffraction".parse().unwrap();
        assert_eq!(spec.requests[Effect::Air as usize], Request::Off);
        assert_eq!(spec.requests[Effect::Diffraction as usize], Request::On);
        assert_eq!(spec.requests[Effect::Transmission as usize], Request::Auto);
        assert!((spec.threshold() - 0.1).abs() < 1e-12);
        let coarse: EffectSpec = "auto:1,-air".parse().unwrap();
        assert_eq!(
            (coarse.threshold(), coarse.requests),
            (1.0, "auto,-air".parse::<EffectSpec>().unwrap().requests)
        );
    }

    #[test]
    fn wrong_specifications_say_what_is_right() {
        let error = |text: &str| text.parse::<EffectSpec>().unwrap_err().to_string();
        assert!(error("some").contains("auto, all or none"));
        assert!(error("auto,air").contains("+air to add or -air to remove"));
        for threshold in ["", "0", "-1", "nan", "loud"] {
            assert!(error(&format!("auto:{threshold}")).contains("number above 0"));
        }
        assert!(error("all:1").contains("auto, all or none"));
        assert!(error("auto,+echo").contains("diffraction, boundary"));
    }
}
