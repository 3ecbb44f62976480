//! Numbers derived from several parameters of one response, with their intervals.
//!
//! Parameters of one response share their batches, so that their errors are correlated: the number is read without each batch in turn and
//! jackknifed like a parameter itself.

use crate::estimate::{Estimate, MaterialChange, NoInterval, ParameterValue, Unsupported};
use crate::jackknife;

/// A number derived from parameters of one response, `of` their values: a mean, a slope. With its interval.
///
/// # Errors
/// The first reason why one of them has no value, or [`Unsupported::NoEnergy`] where there is none at all.
pub fn derived<'a>(
    of: impl Fn(&[f64]) -> f64,
    parameters: impl IntoIterator<Item = &'a ParameterValue>,
) -> ParameterValue {
    let estimates: Vec<&Estimate> = parameters
        .into_iter()
        .map(|estimate| estimate.as_ref().map_err(Clone::clone))
        .collect::<Result<_, _>>()?;
    let first = *estimates.first().ok_or(Unsupported::NoEnergy)?;
    let take = |read: &dyn Fn(&Estimate) -> f64| {
        of(&estimates.iter().map(|estimate| read(estimate)).collect::<Vec<f64>>())
    };
    let value = take(&|estimate| estimate.value);
    let materials = by_materials(&of, &estimates, value);
    let bare = |interval| Estimate {
        is_time: first.is_time,
        materials: materials.clone(),
        ..Estimate::bare(value, interval)
    };
    if let Some(reason) = estimates.iter().find_map(|estimate| estimate.interval.as_ref().err()) {
        return Ok(bare(Err(reason.clone())));
    }
    if estimates.iter().any(|estimate| estimate.weight != first.weight) || first.weight.is_empty() {
        return Ok(bare(Err(NoInterval::NoBatches)));
    }
    let without: Vec<f64> =
        (0..first.weight.len()).map(|g| take(&|estimate: &Estimate| estimate.without[g])).collect();
    // Batches are read in coarser bins than the values, so that their own mean is the centre of the jackknife.
    let centre = without.iter().zip(&first.weight).map(|(value, weight)| value * weight).sum();
    let spread = jackknife::spread(centre, &without, &first.weight);
    // What the parameters' own intervals hold beside noise (bias of discs, the end of the run) does not average out.
    let values: Vec<f64> = estimates.iter().map(|estimate| estimate.value).collect();
    let mut interval = [value - spread.half_width, value + spread.half_width];
    for (at, estimate) in estimates.iter().enumerate() {
        for beyond in beyond_noise(estimate) {
            let mut values = values.clone();
            values[at] += beyond;
            let moved = of(&values) - value;
            interval[usize::from(moved > 0.0)] += moved;
        }
    }
    Ok(Estimate {
        error: Some(spread.error),
        without,
        weight: first.weight.clone(),
        warning: spread.warning,
        ..bare(Ok(interval))
    })
}

/// Share of a standard uncertainty over which the derived number is taken as linear.
const SMALL: f64 = 1e-3;

/// Changes of the derived `value` by each material; none where a parameter has none.
fn by_materials(of: &impl Fn(&[f64]) -> f64, estimates: &[&Estimate], value: f64) -> Vec<MaterialChange> {
    let count = estimates.first().map_or(0, |first| first.materials.len());
    if estimates.iter().any(|estimate| estimate.materials.len() != count) {
        return Vec::new();
    }
    let change = |m: usize, read: &dyn Fn(&MaterialChange) -> f64| {
        let moved = |estimate: &&Estimate| estimate.value + SMALL * read(&estimate.materials[m]);
        (of(&estimates.iter().map(moved).collect::<Vec<f64>>()) - value) / SMALL
    };
    let changes = |m: usize| MaterialChange {
        by_one: change(m, &|of| of.by_one),
        at_ends: [0, 1].map(|end| change(m, &|of| of.at_ends[end])),
    };
    (0..count).map(changes).collect()
}

/// Reach of an interval beyond its noise: below, negative or zero, and above.
fn beyond_noise(estimate: &Estimate) -> [f64; 2] {
    let Ok([low, high]) = &estimate.interval else { return [0.0; 2] };
    let centre = estimate.without.iter().zip(&estimate.weight).map(|(value, weight)| value * weight).sum();
    let noise = jackknife::spread(centre, &estimate.without, &estimate.weight).half_width;
    [(low - estimate.value + noise).min(0.0), (high - estimate.value - noise).max(0.0)]
}
