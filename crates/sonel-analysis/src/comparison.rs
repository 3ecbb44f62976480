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

use crate::derived::derived;
use crate::estimate::{Estimate, Interval, NoInterval, ParameterValue, StandardError};
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
    /// |B − A| in just-noticeable differences; none of a window, for which none is known.
    pub just_noticeable: Option<f64>,
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
    /// About the value of `a`; none where none is known.
    just_noticeable: Option<f64>,
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
            just_noticeable: Some(parameter.just_noticeable(number(band.parameter(parameter)))),
            a: band.parameter(parameter),
            b: other.parameter(parameter),
        }));
        let windows = WINDOWS.iter().zip(&band.windows).zip(&other.windows);
        pairs.extend(windows.map(|((window, a), b)| Pair {
            receiver,
            center_frequency_hz: Some(center),
            key: window.key,
            just_noticeable: None,
            a,
            b,
        }));
    }
    pairs.push(Pair {
        receiver,
        center_frequency_hz: None,
        key: "speech_transmission_index",
        just_noticeable: Some(noticeable::SPEECH_TRANSMISSION_INDEX),
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
        let interval @ [low, high] = found.interval.clone().ok()?;
        let rounding = ROUNDING * number(self.a).abs().max(number(self.b).abs());
        let to_zero = if value > 0.0 { value - low } else { high - value };
        let noise = |level: f64| student::quantile(level, error.freedom) * error.sigma;
        Some(Difference {
            source: self.receiver.source.clone(),
            receiver: self.receiver.name.clone(),
            center_frequency_hz: self.center_frequency_hz,
            estimate: self.key,
            value,
            interval,
            just_noticeable: self.just_noticeable.map(|unit| value.abs() / unit),
            // What the interval holds beside noise is the same at every level.
            differs: value.abs() > to_zero + noise(level) - noise(MISSED) + rounding,
        })
    }
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
            Some(true) if self.just_noticeable >= 1.0 => " *",
            _ => "",
        }
    }
}

/// `b` − `a`, with its 95 % interval. Estimates that share their batches are subtracted batch by batch; else the sides of both intervals add by
/// their squares. A single measurement, whose error nobody knows, adds nothing to the interval of a simulation.
///
/// # Errors
/// The first reason why one of them has no value.
pub fn difference(a: &ParameterValue, b: &ParameterValue, pairing: Pairing) -> ParameterValue {
    let [first, second] = [a, b].map(|value| value.as_ref().map_err(Clone::clone));
    let (first, second) = (first?, second?);
    if pairing == Pairing::Batches && first.weight == second.weight && !first.weight.is_empty() {
        let joint = derived(|values| values[1] - values[0], [a, b])?;
        return Ok(Estimate { is_time: false, materials: Vec::new(), ..joint });
    }
    let value = second.value - first.value;
    let interval = match (reaches(first), reaches(second)) {
        (Ok([below, above]), Ok([less, more])) => {
            Ok([value - libm::hypot(less, above), value + libm::hypot(more, below)])
        }
        (Err(NoInterval::SingleMeasurement), Ok([below, above]))
        | (Ok([above, below]), Err(NoInterval::SingleMeasurement)) => Ok([value - below, value + above]),
        (Err(reason), _) | (_, Err(reason)) => Err(reason),
    };
    let error = first.error.zip(second.error).map(|(a, b)| welch(a, b));
    Ok(Estimate { error: error.filter(|_| interval.is_ok()), ..Estimate::bare(value, interval) })
}

/// How far the interval of `estimate` reaches below and above its value.
fn reaches(estimate: &Estimate) -> Interval {
    estimate.interval.clone().map(|[low, high]| [estimate.value - low, high - estimate.value])
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
    use crate::jackknife;

    #[test]
    fn sidaks_levels_add_up_to_the_family() {
        assert!((sidak(1) - 0.01).abs() < 1e-15);
        for count in [2, 73, 10_000] {
            let none = (1.0 - sidak(count)).powi(count as i32);
            assert!((none - 0.99).abs() < 1e-9, "{count}");
        }
    }

    /// A value from four batches, `without` each of them, whose interval reaches `beside` further than noise.
    fn of_batches(value: f64, without: [f64; 4], beside: f64) -> Estimate {
        let weight = vec![0.25; 4];
        let spread = jackknife::spread(without.iter().sum::<f64>() / 4.0, &without, &weight);
        let half_width = spread.half_width + beside;
        Estimate {
            error: Some(spread.error),
            without: without.to_vec(),
            weight,
            ..Estimate::bare(value, Ok([value - half_width, value + half_width]))
        }
    }

    fn half_width(found: &Estimate) -> f64 {
        let [low, high] = found.interval.clone().unwrap();
        0.5 * (high - low)
    }

    #[test]
    fn differences_of_shared_batches_keep_what_is_beside_noise() {
        let a = of_batches(2.0, [1.9, 2.0, 2.05, 2.05], 0.0);
        let b = of_batches(2.5, [2.4, 2.5, 2.55, 2.55], 0.3);
        let pair = [Ok(a.clone()), Ok(b.clone())];
        let joint = difference(&pair[0], &pair[1], Pairing::Batches).unwrap();
        assert!((half_width(&joint) - 0.3).abs() < 1e-12, "{joint:?}");
        let apart = difference(&pair[0], &pair[1], Pairing::Independent).unwrap();
        assert!((half_width(&apart) - libm::hypot(half_width(&a), half_width(&b))).abs() < 1e-12);
        let other = Ok(Estimate { weight: vec![0.1, 0.2, 0.3, 0.4], ..b });
        let unshared = difference(&pair[0], &other, Pairing::Batches).unwrap();
        assert!((half_width(&unshared) - half_width(&apart)).abs() < 1e-12, "batches of other weights");
    }

    /// 2.74 ± 0.32 against a measured 2.951 is noise.
    #[test]
    fn a_measurement_is_compared_with_the_interval_of_the_simulation() {
        let simulated = Ok(Estimate::bare(2.74, Ok([2.40, 3.06])));
        let measured = |value| Ok(Estimate::bare(value, Err(NoInterval::SingleMeasurement)));
        let mark = |a: &ParameterValue, b: &ParameterValue| {
            Significance::of(&difference(a, b, Pairing::Independent).unwrap(), 0.05 * 2.74).mark()
        };
        assert_eq!([mark(&simulated, &measured(2.951)), mark(&measured(2.951), &simulated)], [" (0)"; 2]);
        assert_eq!([mark(&simulated, &measured(3.2)), mark(&measured(2.3), &simulated)], [" *"; 2]);
        assert_eq!(mark(&measured(2.0), &measured(3.0)), "", "nobody knows the interval");
        let sharp = Ok(Estimate::bare(2.74, Ok([2.73, 2.75])));
        assert_eq!(mark(&sharp, &measured(2.80)), "", "beyond the interval and not noticed");
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
