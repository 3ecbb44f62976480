//! The parameters of one echogram from all batches, and without each of them.

use sonel_echogram::Response;

use crate::decay::Echogram;
use crate::estimate::{Estimate, KernelShift, NoInterval, ParameterValue, Unsupported};
use crate::jackknife::{self, BatchSpread};
use crate::listed::Arrival;
use crate::parameter::{LevelScale, Values};

/// Readings from the coarse bins of the batches.
#[derive(Debug)]
pub struct Parts {
    /// As the batches are.
    pub readings: Readings,
    /// The same freed of the bias of discs and spheres; none where there is no such bias.
    unbiased: Option<Readings>,
    /// Weights, above zero, adding up to 1.
    pub weight: Vec<f64>,
    /// Whether no batch holds any energy, though the echogram may hold what single numbers cannot.
    is_silent: bool,
}

/// Readings from all batches and without each of them.
#[derive(Debug)]
pub struct Readings {
    /// From all batches.
    pub all: Values,
    /// Without each of them.
    pub without: Vec<Values>,
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
        let differences = weighted(&stored.weight, |g| response.kernel_difference(g, s, r, b));
        let differences: Vec<&[f32]> = differences.map(|(_, bins)| bins).collect();
        let is_biased = differences.iter().copied().flatten().any(|difference| difference.abs() > 0.0);
        Ok(Self {
            readings: Readings::of(&batches, &read),
            unbiased: is_biased.then(|| Readings::unbiased(&batches, &differences, &read)),
            weight: batches.iter().map(|&(weight, _)| weight).collect(),
            is_silent: batches.iter().all(|(_, bins)| bins.iter().all(|energy| *energy <= 0.0)),
        })
    }

    fn unbiased(&self) -> &Readings {
        self.unbiased.as_ref().unwrap_or(&self.readings)
    }
}

impl Readings {
    fn of(batches: &[(f64, &[f32])], read: &impl Fn(&[f64]) -> Values) -> Self {
        let mean = mean(batches);
        let without = batches.iter().map(|&(weight, batch)| read(&leave_out(&mean, weight, batch)));
        let positive: Vec<f64> = mean.iter().map(|energy| energy.max(0.0)).collect();
        Self { without: without.collect(), all: read(&positive) }
    }

    /// Readings of energy less its bias, which is minus twice the difference that half the area makes: what is averaged over
    /// an area has a bias of O(h²), so half of it is left over half the area (docs/physics.md §7).
    fn unbiased(batches: &[(f64, &[f32])], differences: &[&[f32]], read: &impl Fn(&[f64]) -> Values) -> Self {
        let corrected = batches.iter().zip(differences).map(|((_, energy), difference)| {
            energy.iter().zip(*difference).map(|(e, d)| e + BIAS_PER_DIFFERENCE * d).collect()
        });
        let corrected: Vec<Vec<f32>> = corrected.collect();
        let weights = batches.iter().map(|(weight, _)| *weight);
        Self::of(&weights.zip(corrected.iter().map(Vec::as_slice)).collect::<Vec<_>>(), read)
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
    let value = value?;
    if !value.is_finite() {
        return Err(Unsupported::BeyondNumbers);
    }
    let parts = match parts {
        Err(reason) => return Ok(Estimate::bare(value, Err(reason.clone()))),
        Ok(parts) if parts.iter().any(|part| part.is_silent) => {
            return Ok(Estimate::bare(value, Err(NoInterval::TooQuiet)));
        }
        Ok(parts) => parts,
    };
    let weight = &parts[0].weight;
    let over = |pick: &dyn Fn(&Parts) -> &Values| {
        read(&parts.iter().map(|part| pick(part)).collect::<Vec<_>>())
            .map_err(|reason| Unsupported::OneBatchDecides { reason: Box::new(reason) })
    };
    let all = over(&|part| &part.readings.all)?;
    let without: Vec<f64> =
        (0..weight.len()).map(|g| over(&|part| &part.readings.without[g])).collect::<Result<_, _>>()?;
    let BatchSpread { half_width, error, warning } = jackknife::spread(all, &without, weight);
    let noise = [value - half_width, value + half_width];
    // Where the parameter cannot be read off the corrected energies, nothing is known of its bias.
    let shift = || -> Result<KernelShift, Unsupported> {
        let shift = over(&|part| &part.unbiased().all)? - all;
        let shift_without = |g: usize| Ok(over(&|part| &part.unbiased().without[g])? - without[g]);
        let shifts: Vec<f64> = (0..weight.len()).map(shift_without).collect::<Result<_, Unsupported>>()?;
        Ok(KernelShift { shift, sigma: jackknife::spread(shift, &shifts, weight).error.sigma })
    };
    let is_biased = parts.iter().any(|part| part.unbiased.is_some());
    let kernel = is_biased.then(shift).and_then(Result::ok);
    let interval = kernel.map_or(noise, |kernel| kernel.extend(noise));
    if !interval.iter().all(|end| end.is_finite()) {
        return Ok(Estimate::bare(value, Err(NoInterval::BeyondNumbers)));
    }
    Ok(Estimate {
        error: Some(error),
        without,
        weight: weight.clone(),
        warning,
        kernel,
        ..Estimate::bare(value, Ok(interval))
    })
}
