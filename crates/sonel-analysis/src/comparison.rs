//! Which parameters of two responses differ beyond noise.
//!
//! Every parameter that both responses have, with a standard error in each, is compared by Welch's t: the difference against
//! √(σ_A² + σ_B²) with the degrees of freedom of Welch and Satterthwaite (rounded down). With many parameters some differ
//! by chance, so each is tested at Šidák's level 1 − 0.99^(1/m): equal responses differ in 1 % of comparisons, whatever the
//! number of parameters m [Sidak1967].
//!
//! The strengths in [`WINDOWS`] are compared, too, to show when a difference arises.
//!
//! Responses of one map, or of runs with one seed, share random numbers batch by batch: there the difference itself is
//! jackknifed, which is sharper the more they share ([`Pairing::Batches`]).
//!
//! References: [Sidak1967], [ISO3382-1] table A.1 for just-noticeable differences (docs/references.md).

use sonel_acoustics::just_noticeable as noticeable;
use sonel_echogram::Provenance;

use crate::estimate::{Estimate, NoInterval, ParameterValue, StandardError};
use crate::jackknife;
use crate::receiver::ReceiverParameters;
use crate::student::{self, MISSED};
use crate::window::WINDOWS;

/// Chance of any difference being found where there is none.
pub(crate) const FAMILY_LEVEL: f64 = 0.01;
/// Figures that carry no noise are equal to this relative difference: what other orders of summation leave.
pub(crate) const ROUNDING: f64 = 1e-9;

/// Relation of the errors of two responses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pairing {
    /// Runs with seeds of their own.
    Independent,
    /// Batch j of one and batch j of the other began with the same random numbers. Where the batches are not the same
    /// parts of both runs, the parameters count as independent.
    Batches,
}

impl Pairing {
    /// Of two responses of this provenance: those of one map, or of runs with one seed and layout, began each batch with the same random numbers.
    #[must_use]
    pub fn of(a: &Provenance, b: &Provenance) -> Self {
        let layout = |of: &Provenance| Some((of.seed?, of.batches?, of.survival?.to_bits()));
        if layout(a).is_some() && layout(a) == layout(b) { Self::Batches } else { Self::Independent }
    }
}

/// One parameter of two responses.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Name of the source.
    pub source: String,
    /// Name of the receiver.
    pub receiver: String,
    /// Nominal centre [Hz]; none for the speech transmission index.
    pub center_frequency_hz: Option<f64>,
    /// Key of the parameter.
    pub estimate: &'static str,
    /// B − A, in the unit of the parameter.
    pub value: f64,
    /// 95 % interval of this difference alone.
    pub interval: [f64; 2],
    /// |B − A| in just-noticeable differences.
    pub just_noticeable: f64,
    /// Whether it is beyond noise, tested at the level of the whole comparison.
    pub differs: bool,
}

/// Differences of the parameters that could be compared.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Comparison {
    /// Figures tested.
    pub differences: Vec<Difference>,
    /// Figures that only one response has, or without interval in one of them.
    pub not_tested: usize,
    /// Level at which each parameter is tested.
    pub level: f64,
}

impl Comparison {
    /// Differences beyond noise.
    pub fn beyond_noise(&self) -> impl Iterator<Item = &Difference> {
        self.differences.iter().filter(|difference| difference.differs)
    }
}

/// Compares what `a` and `b` have in common: sources and receivers by name, bands by centre.
#[must_use]
pub fn compare(a: &[ReceiverParameters], b: &[ReceiverParameters], pairing: Pairing) -> Comparison {
    let mut pairs = Vec::new();
    for a in a {
        if let Some(b) = b.iter().find(|b| (&b.source, &b.name) == (&a.source, &a.name)) {
            pair_up(a, b, &mut pairs);
        }
    }
    pairs.retain(|pair| pair.a.is_ok() || pair.b.is_ok());
    let found: Vec<(&Pair<'_>, Estimate)> =
        pairs.iter().filter_map(|pair| Some((pair, difference(pair.a, pair.b, pairing).ok()?))).collect();
    let tested = found.iter().filter(|(_, found)| found.error.is_some()).count();
    let level = sidak(tested);
    Comparison {
        differences: found.iter().filter_map(|(pair, found)| pair.tested(found, level)).collect(),
        not_tested: pairs.len() - tested,
        level,
    }
}

/// Level of each of `count` tests that together err with [`FAMILY_LEVEL`].
fn sidak(count: usize) -> f64 {
    -libm::expm1(libm::log1p(-FAMILY_LEVEL) / count.max(1) as f64)
}

/// One parameter of both responses.
struct Pair<'a> {
    receiver: &'a ReceiverParameters,
    center_frequency_hz: Option<f64>,
    key: &'static str,
    /// About the value of `a`.
    just_noticeable: f64,
    a: &'a ParameterValue,
    b: &'a ParameterValue,
}

fn pair_up<'a>(receiver: &'a ReceiverParameters, b: &'a ReceiverParameters, pairs: &mut Vec<Pair<'a>>) {
    for band in &receiver.bands {
        let center = band.center_frequency_hz;
        let Some(other) = b.band(center) else { continue };
        pairs.extend(band.parameters().map(|parameter| Pair {
            receiver,
            center_frequency_hz: Some(center),
            key: parameter.key(),
            just_noticeable: parameter.just_noticeable(number(band.parameter(parameter))),
            a: band.parameter(parameter),
            b: other.parameter(parameter),
        }));
        let windows = WINDOWS.iter().zip(&band.windows).zip(&other.windows);
        pairs.extend(windows.map(|((window, a), b)| Pair {
            receiver,
            center_frequency_hz: Some(center),
            key: window.key,
            just_noticeable: noticeable::LEVEL_DB,
            a,
            b,
        }));
    }
    pairs.push(Pair {
        receiver,
        center_frequency_hz: None,
        key: "speech_transmission_index",
        just_noticeable: noticeable::SPEECH_TRANSMISSION_INDEX,
        a: &receiver.speech_transmission_index,
        b: &b.speech_transmission_index,
    });
}

/// The value, which is of no matter where there is none.
fn number(of: &ParameterValue) -> f64 {
    of.as_ref().map_or(f64::NAN, |estimate| estimate.value)
}

impl Pair<'_> {
    /// What was `found`, tested at `level`; none without an interval.
    fn tested(&self, found: &Estimate, level: f64) -> Option<Difference> {
        let (error, value) = (found.error?, found.value);
        let rounding = ROUNDING * number(self.a).abs().max(number(self.b).abs());
        Some(Difference {
            source: self.receiver.source.clone(),
            receiver: self.receiver.name.clone(),
            center_frequency_hz: self.center_frequency_hz,
            estimate: self.key,
            value,
            interval: found.interval.clone().ok()?,
            just_noticeable: value.abs() / self.just_noticeable,
            differs: value.abs() > student::quantile(level, error.freedom) * error.sigma + rounding,
        })
    }
}

/// Standard error of the difference of two estimates that have one.
fn joint_error(a: &Estimate, b: &Estimate, pairing: Pairing) -> Option<StandardError> {
    let (error_a, error_b) = (a.error?, b.error?);
    if pairing == Pairing::Independent || a.weight != b.weight {
        return Some(welch(error_a, error_b));
    }
    let without: Vec<f64> = a.without.iter().zip(&b.without).map(|(a, b)| b - a).collect();
    Some(jackknife::spread(b.value - a.value, &without, &a.weight).error)
}

/// What a difference means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Significance {
    /// Its size in just-noticeable differences.
    pub just_noticeable: f64,
    /// Whether zero lies outside its 95 % interval; none without an interval.
    pub is_beyond_noise: Option<bool>,
}

impl Significance {
    /// Of a difference, where a listener notices `just_noticeable` in its unit.
    #[must_use]
    pub fn of(difference: &Estimate, just_noticeable: f64) -> Self {
        let interval = difference.interval.as_ref().ok();
        Self {
            just_noticeable: difference.value.abs() / just_noticeable,
            is_beyond_noise: interval.map(|[low, high]| *low > 0.0 || *high < 0.0),
        }
    }

    /// ` (0)` for noise, ` *` for what is beyond it and noticed.
    #[must_use]
    pub fn mark(self) -> &'static str {
        match self.is_beyond_noise {
            Some(false) => " (0)",
            _ if self.just_noticeable >= 1.0 => " *",
            _ => "",
        }
    }
}

/// `b` − `a`, with its 95 % interval; without one where either has none.
///
/// # Errors
/// The first reason why one of them has no value.
pub fn difference(a: &ParameterValue, b: &ParameterValue, pairing: Pairing) -> ParameterValue {
    let (a, b) = (a.as_ref().map_err(Clone::clone)?, b.as_ref().map_err(Clone::clone)?);
    let value = b.value - a.value;
    let reason = [a, b].into_iter().find_map(|estimate| estimate.interval.as_ref().err());
    let joint = joint_error(a, b, pairing);
    let interval = match (reason, joint) {
        (None, Some(joint)) => {
            let half_width = student::quantile(MISSED, joint.freedom) * joint.sigma;
            Ok([value - half_width, value + half_width])
        }
        (reason, _) => Err(reason.cloned().unwrap_or(NoInterval::NoBatches)),
    };
    Ok(Estimate { error: joint.filter(|_| interval.is_ok()), ..Estimate::bare(value, interval) })
}

/// Standard error of a difference, with the degrees of freedom of Welch and Satterthwaite.
pub(crate) fn welch(a: StandardError, b: StandardError) -> StandardError {
    let (var_a, var_b) = (a.sigma * a.sigma, b.sigma * b.sigma);
    let fourth = var_a * var_a / f64::from(a.freedom) + var_b * var_b / f64::from(b.freedom);
    let freedom = if fourth > 0.0 {
        ((var_a + var_b) * (var_a + var_b) / fourth) as u32
    } else {
        a.freedom.min(b.freedom)
    };
    StandardError { sigma: (var_a + var_b).sqrt(), freedom: freedom.max(1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sidaks_levels_add_up_to_the_family() {
        assert!((sidak(1) - 0.01).abs() < 1e-15);
        for count in [2, 73, 10_000] {
            let none = (1.0 - sidak(count)).powi(count as i32);
            assert!((none - 0.99).abs() < 1e-9, "{count}");
        }
    }

    #[test]
    fn welch_is_student_for_equal_errors_and_the_noisier_one_else() {
        let noisy = StandardError { sigma: 2.0, freedom: 31 };
        let joint = welch(noisy, noisy);
        assert!((joint.sigma - 8.0_f64.sqrt()).abs() < 1e-12 && joint.freedom == 62);
        let alone = welch(noisy, StandardError { sigma: 0.0, freedom: 7 });
        assert!((alone.sigma - 2.0).abs() < 1e-12 && alone.freedom == 31);
    }
}
