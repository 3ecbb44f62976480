//! The parameters of one echogram from all batches, and without each of them.

use sonel_echogram::Response;

use crate::decay::Echogram;
use crate::estimate::{Estimate, KernelShift, NoInterval, ParameterValue, StandardError, Unsupported};
use crate::jackknife;
use crate::listed::Arrival;
use crate::parameter::{LevelScale, Values};

/// Readings from the coarse bins of the batches.
#[derive(Debug)]
pub struct Parts {
    /// From all batches.
    pub all: Values,
    /// Without each of them.
    pub without: Vec<Values>,
    /// Weights, above zero, adding up to 1.
    pub weight: Vec<f64>,
    /// The same readings freed of the bias of discs and spheres; none where there is no such bias.
    pub unbiased: Option<Readings>,
    /// Whether no batch holds any energy, though the echogram may hold what single numbers cannot.
    pub is_silent: bool,
}

/// Readings from all batches and without each of them.
#[derive(Debug)]
pub struct Readings {
    all: Values,
    without: Vec<Values>,
}

impl Parts {
    /// Reads the parameters of source `s` at receiver `r` in band `b`, where `arrivals` are listed.
    ///
    /// # Errors
    /// When the response holds fewer than two batches of any weight.
    pub fn read(
        response: &Response,
        s: usize,
        r: usize,
        b: usize,
        arrivals: &[Arrival],
        scale: Option<LevelScale>,
    ) -> Result<Self, NoInterval> {
        let none = if response.is_measured() { NoInterval::SingleMeasurement } else { NoInterval::NoBatches };
        let stored = response.batches.as_ref().ok_or(none)?;
        let edges = response.batch_edges(s, r).ok_or(NoInterval::NoBatches)?;
        let batches: Vec<(f64, &[f32])> =
            weighted(&stored.weight, |g| response.batch_echogram(g, s, r, b)).collect();
        if batches.len() < 2 {
            return Err(if batches.is_empty() { NoInterval::NoBatches } else { NoInterval::OneBatch });
        }
        let direct_time = response.direct_time(s, r);
        let read = |energy: &[f64]| Values::read(Echogram { edges, energy, direct_time, arrivals }, scale);
        let mean_energy = mean(&batches);
        let without =
            batches.iter().map(|&(weight, batch)| read(&leave_out(&mean_energy, weight, batch))).collect();
        let differences: Vec<(f64, &[f32])> =
            weighted(&stored.weight, |g| response.kernel_difference(g, s, r, b)).collect();
        let is_biased =
            differences.iter().any(|(_, bins)| bins.iter().any(|difference| difference.abs() > 0.0));
        Ok(Self {
            unbiased: is_biased.then(|| unbiased(&batches, &differences, &read)),
            without,
            all: read(&mean_energy),
            is_silent: mean_energy.iter().all(|energy| *energy <= 0.0),
            weight: batches.iter().map(|&(weight, _)| weight).collect(),
        })
    }
}

/// What there is of batches with any weight, each with its share of all weights.
pub fn weighted<'a>(
    weights: &[f64],
    of: impl Fn(usize) -> Option<&'a [f32]>,
) -> impl Iterator<Item = (f64, &'a [f32])> {
    let sum: f64 = weights.iter().sum();
    let weights = weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0);
    weights.filter_map(move |(g, weight)| Some((weight / sum, of(g)?)))
}

/// Weighted mean of the batches per bin. Where all agree it is their value to the last bit: certainty has no spread.
fn mean(batches: &[(f64, &[f32])]) -> Vec<f64> {
    let first = batches[0].1;
    (0..first.len())
        .map(|bin| {
            if batches.iter().all(|(_, batch)| batch[bin].to_bits() == first[bin].to_bits()) {
                f64::from(first[bin])
            } else {
                batches.iter().map(|(weight, batch)| weight * f64::from(batch[bin])).sum()
            }
        })
        .collect()
}

/// Readings of energy less its bias, which is minus twice the difference that half the area makes: what is averaged over
/// an area has a bias of O(h²), so half of it is left over half the area (docs/physics.md §7).
fn unbiased(
    batches: &[(f64, &[f32])],
    differences: &[(f64, &[f32])],
    read: &impl Fn(&[f64]) -> Values,
) -> Readings {
    let corrected: Vec<(f64, Vec<f32>)> = batches
        .iter()
        .zip(differences)
        .map(|(&(weight, energy), (_, difference))| {
            let corrected = energy.iter().zip(*difference).map(|(e, d)| e + BIAS_PER_DIFFERENCE * d);
            (weight, corrected.collect())
        })
        .collect();
    let corrected: Vec<(f64, &[f32])> =
        corrected.iter().map(|(weight, energy)| (*weight, energy.as_slice())).collect();
    let mean = mean(&corrected);
    let without = corrected.iter().map(|&(weight, batch)| read(&leave_out(&mean, weight, batch)));
    let positive: Vec<f64> = mean.iter().map(|energy| energy.max(0.0)).collect();
    Readings { without: without.collect(), all: read(&positive) }
}

/// What half the area adds to the energy, times this, frees it of its O(h²) bias.
const BIAS_PER_DIFFERENCE: f32 = 2.0;

/// Mean of the others: (mean − w e) / (1 − w), as mean + (mean − e) w / (1 − w).
fn leave_out(mean: &[f64], weight: f64, batch: &[f32]) -> Vec<f64> {
    let share = weight / (1.0 - weight);
    mean.iter()
        .zip(batch)
        // Rounding may leave a bin that only this batch fills a little below zero.
        .map(|(mean, batch)| (mean + (mean - f64::from(*batch)) * share).max(0.0))
        .collect()
}

/// The parameter `value` with the interval that `read` finds from the parts. What leaves here is finite or has a reason.
pub fn estimate(
    value: Result<f64, Unsupported>,
    parts: Result<&[&Parts], &NoInterval>,
    read: impl Fn(&[&Values]) -> Result<f64, Unsupported>,
) -> ParameterValue {
    let value = finite(value)?;
    let estimate = |interval, error, without, weight, warning, kernel| Estimate {
        value,
        interval,
        error,
        without,
        weight,
        warning,
        decay: None,
        kernel,
        is_time: false,
        materials: Vec::new(),
    };
    let parts = match parts {
        Ok(parts) => parts,
        Err(reason) => return Ok(estimate(Err(reason.clone()), None, Vec::new(), Vec::new(), None, None)),
    };
    let without_interval = |reason| Ok(estimate(Err(reason), None, Vec::new(), Vec::new(), None, None));
    if parts.iter().any(|part| part.is_silent) {
        return without_interval(NoInterval::TooQuiet);
    }
    let PartSpread { half_width, error, warning, without, weight, kernel } = spread(parts, read)?;
    let noise = [value - half_width, value + half_width];
    let interval = kernel.map_or(noise, |kernel| kernel.extend(noise));
    if !interval.iter().all(|end| end.is_finite()) {
        return without_interval(NoInterval::BeyondNumbers);
    }
    Ok(estimate(Ok(interval), Some(error), without, weight, warning, kernel))
}

/// The one place where a number that is none would leave the readings.
fn finite(value: Result<f64, Unsupported>) -> Result<f64, Unsupported> {
    value.and_then(|value| if value.is_finite() { Ok(value) } else { Err(Unsupported::BeyondNumbers) })
}

/// Values of a parameter in the parts.
struct PartSpread {
    half_width: f64,
    error: StandardError,
    warning: Option<String>,
    without: Vec<f64>,
    weight: Vec<f64>,
    kernel: Option<KernelShift>,
}

/// Jackknife of what `read` makes of the parts of one band or, for parameters over bands, of several.
fn spread(
    parts: &[&Parts],
    read: impl Fn(&[&Values]) -> Result<f64, Unsupported>,
) -> Result<PartSpread, Unsupported> {
    let take = |pick: &dyn Fn(&Parts) -> &Values| {
        let values: Vec<&Values> = parts.iter().map(|part| pick(part)).collect();
        read(&values).map_err(|reason| Unsupported::OneBatchDecides { reason: Box::new(reason) })
    };
    let all = take(&|part| &part.all)?;
    let weight = &parts[0].weight;
    let without: Vec<f64> =
        (0..weight.len()).map(|g| take(&|part| &part.without[g])).collect::<Result<_, _>>()?;
    let spread = jackknife::spread(all, &without, weight);
    Ok(PartSpread {
        half_width: spread.half_width,
        kernel: kernel_shift(parts, &read, all, &without),
        error: spread.error,
        warning: spread.warning,
        without,
        weight: weight.clone(),
    })
}

/// How the parameter, `all` and `without` each batch, shifts when it is freed of the bias of discs and spheres. [`None`] where
/// nothing is averaged over an area, or where the parameter cannot be read off the corrected energies.
fn kernel_shift(
    parts: &[&Parts],
    read: &impl Fn(&[&Values]) -> Result<f64, Unsupported>,
    all: f64,
    without: &[f64],
) -> Option<KernelShift> {
    if parts.iter().all(|part| part.unbiased.is_none()) {
        return None;
    }
    let take = |pick: &dyn Fn(&Parts) -> &Values| {
        let values: Vec<&Values> = parts.iter().map(|part| pick(part)).collect();
        read(&values).ok()
    };
    let shift = take(&|part| part.unbiased.as_ref().map_or(&part.all, |readings| &readings.all))? - all;
    let shifts = (0..without.len()).map(|g| {
        let unbiased =
            take(&|part| part.unbiased.as_ref().map_or(&part.without[g], |readings| &readings.without[g]))?;
        Some(unbiased - without[g])
    });
    let shifts: Vec<f64> = shifts.collect::<Option<_>>()?;
    let sigma = jackknife::spread(shift, &shifts, &parts[0].weight).error.sigma;
    Some(KernelShift { shift, sigma })
}
