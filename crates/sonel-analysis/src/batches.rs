//! The parameters of one echogram from all batches, and without each of them.

use sonel_echogram::Response;

use crate::decay::Echogram;
use crate::figure::{Estimate, Figure, NoInterval, Unsupported};
use crate::jackknife;
use crate::parameter::{LevelScale, Values};

/// Readings from the coarse bins of the batches.
#[derive(Debug)]
pub struct Parts {
    /// From all batches.
    pub all: Values,
    /// Without each of them.
    pub without: Vec<Values>,
    /// Their weights, above zero, adding up to 1.
    pub weight: Vec<f64>,
}

impl Parts {
    /// Reads the parameters of source `s` at receiver `r` in band `b`.
    ///
    /// # Errors
    /// When the response holds fewer than two batches of any weight.
    pub fn read(
        response: &Response,
        (s, r, b): (usize, usize, usize),
        scale: LevelScale,
    ) -> Result<Self, NoInterval> {
        let stored = response.batches.as_ref().ok_or(NoInterval::NoBatches)?;
        let edges = response.batch_edges(s, r).ok_or(NoInterval::NoBatches)?;
        let sum: f64 = stored.weight.iter().sum();
        let batches: Vec<(f64, &[f32])> = stored
            .weight
            .iter()
            .enumerate()
            .filter(|(_, weight)| **weight > 0.0)
            .filter_map(|(g, weight)| Some((weight / sum, response.batch_echogram(g, s, r, b)?)))
            .collect();
        if batches.len() < 2 {
            return Err(if batches.is_empty() { NoInterval::NoBatches } else { NoInterval::OneBatch });
        }
        let direct_time = response.direct_time(s, r);
        let read = |energy: &[f64]| Values::read(Echogram { edges, energy, direct_time }, scale);
        let mean = mean(&batches);
        let without = batches.iter().map(|&(weight, batch)| read(&leave_out(&mean, weight, batch)));
        Ok(Self {
            without: without.collect(),
            all: read(&mean),
            weight: batches.iter().map(|&(weight, _)| weight).collect(),
        })
    }
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

/// Mean of the others: (mean − w e) / (1 − w), as mean + (mean − e) w / (1 − w).
fn leave_out(mean: &[f64], weight: f64, batch: &[f32]) -> Vec<f64> {
    let share = weight / (1.0 - weight);
    mean.iter()
        .zip(batch)
        // Rounding may leave a bin that only this batch fills a little below zero.
        .map(|(mean, batch)| (mean + (mean - f64::from(*batch)) * share).max(0.0))
        .collect()
}

/// The figure `value` with the interval that `read` finds from the parts.
pub fn figure(
    value: Result<f64, Unsupported>,
    parts: Result<&[&Parts], &NoInterval>,
    read: impl Fn(&[&Values]) -> Result<f64, Unsupported>,
) -> Figure {
    let value = value?;
    Ok(match parts.map_err(Clone::clone).and_then(|parts| spread(parts, read)) {
        Ok(spread) => Estimate {
            value,
            interval: Ok([value - spread.half_width, value + spread.half_width]),
            error: Some(spread.error),
            warning: spread.warning,
            decay: None,
        },
        Err(reason) => Estimate { value, interval: Err(reason), error: None, warning: None, decay: None },
    })
}

/// Jackknife of what `read` makes of the parts of one band or, for figures over bands, of several.
fn spread(
    parts: &[&Parts],
    read: impl Fn(&[&Values]) -> Result<f64, Unsupported>,
) -> Result<jackknife::Spread, NoInterval> {
    let take = |pick: &dyn Fn(&Parts) -> &Values| {
        let values: Vec<&Values> = parts.iter().map(|part| pick(part)).collect();
        read(&values).map_err(NoInterval::Part)
    };
    let all = take(&|part| &part.all)?;
    let weight = &parts[0].weight;
    let without: Vec<f64> =
        (0..weight.len()).map(|g| take(&|part| &part.without[g])).collect::<Result<_, _>>()?;
    Ok(jackknife::spread(all, &without, weight))
}
