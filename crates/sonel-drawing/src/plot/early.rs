//! Early reflections: the strength of every listed arrival over its delay to the direct sound, a series for each order.
//!
//! The strength of an arrival with the fluence F per unit emitted energy is 10 lg(400π F) dB: the part it has in G, 0 dB at 10 m in a free
//! field. Reflections off scattering surfaces and late ones are not listed; the echogram has them.
//!
//! References: [ISO3382-1] annex A (docs/references.md).

use sonel_acoustics::strength_db;
use sonel_echogram::{ArrivalKind, Response};

use super::response::title;
use super::{Axis, Mark, Panel, Point, Series};

/// Delays shown at least: C80 counts these as early, and a little more [ms].
const SHOWN_MS: f64 = 100.0;
/// What is shown below the strongest arrival [dB].
const SHOWN_DB: f64 = 50.0;
/// Where the first reflection is later than [`SHOWN_MS`], this part of its delay is shown.
const BEYOND: f64 = 1.5;

/// A listed arrival with energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrival {
    /// Among those of the response.
    pub index: usize,
    /// Number of reflections.
    pub order: u32,
    /// Whether it came over an edge.
    pub over_edge: bool,
    /// Delay to the geometric direct arrival [ms].
    pub delay_ms: f64,
    /// Its part in G [dB].
    pub strength_db: f64,
}

/// Arrivals of source `s` at receiver `r`: of one band, or of all, weighted by the power of the source.
#[must_use]
pub fn arrivals(response: &Response, (s, r): (usize, usize), band: Option<usize>) -> Vec<Arrival> {
    let (listed, bands, direct) = (&response.arrivals, response.bands(), response.direct_time(s, r));
    let power = &response.source_power_level_db[s * bands..(s + 1) * bands];
    let weights: Vec<f64> = power.iter().map(|level| libm::exp10(0.1 * level)).collect();
    let of_pair = (0..listed.source.len())
        .filter(|&a| (listed.source[a] as usize, listed.receiver[a] as usize) == (s, r));
    of_pair
        .map(|index| {
            let energy = &listed.energy[index * bands..(index + 1) * bands];
            let mean = energy.iter().zip(&weights).map(|(energy, weight)| energy * weight).sum::<f64>();
            let fluence = band.map_or(mean / weights.iter().sum::<f64>(), |band| energy[band]);
            Arrival {
                index,
                order: listed.order[index],
                over_edge: listed.kind[index] == ArrivalKind::Edge as u32,
                delay_ms: 1000.0 * (listed.time_s[index] - direct),
                strength_db: strength_db(fluence),
            }
        })
        .filter(|arrival| arrival.strength_db.is_finite())
        .collect()
}

/// Delay up to which `arrivals` are early reflections [ms].
#[must_use]
pub fn shown_ms(arrivals: &[Arrival]) -> f64 {
    let first =
        arrivals.iter().map(|arrival| arrival.delay_ms).filter(|delay| *delay > 0.0).min_by(f64::total_cmp);
    SHOWN_MS.max(first.map_or(0.0, |first| BEYOND * first))
}

/// [`arrivals`] over their delays, a series for each order. [`None`] where there is none.
#[must_use]
pub fn early(response: &Response, (s, r): (usize, usize), band: Option<usize>) -> Option<Panel> {
    let arrivals = arrivals(response, (s, r), band);
    let highest = arrivals.iter().map(|arrival| arrival.strength_db).max_by(f64::total_cmp)?;
    let last = shown_ms(&arrivals);
    let of_all = "all bands".to_owned();
    let name = band.map_or(of_all, |band| format!("{} Hz", response.center_frequency_hz[band]));
    Some(Panel {
        title: title(&format!("Early reflections, {name}"), response, s, r),
        x: Axis::linear("delay to the direct sound [ms]").from_to(-0.03 * last, last),
        y: Axis::linear("strength of the arrival [dB]").from_to(highest - SHOWN_DB, highest + 3.0),
        series: series(&arrivals),
    })
}

/// What arrivals of so many reflections, over an edge or not, are called in legends.
#[must_use]
pub fn class_name(order: u32, over_edge: bool) -> String {
    let edge = if over_edge { ", over an edge" } else { "" };
    match order {
        0 => format!("direct sound{}", edge.trim_start_matches(',')),
        1 => format!("1 reflection{edge}"),
        _ => format!("{order} reflections{edge}"),
    }
}

fn series(arrivals: &[Arrival]) -> Vec<Series> {
    let class = |arrival: &Arrival| (arrival.order, arrival.over_edge);
    let mut classes: Vec<(u32, bool)> = arrivals.iter().map(class).collect();
    classes.sort_unstable();
    classes.dedup();
    classes
        .into_iter()
        .map(|own| {
            let points = arrivals.iter().filter(|arrival| class(arrival) == own);
            let points = points.map(|arrival| Point::new(arrival.delay_ms, arrival.strength_db)).collect();
            Series::new(class_name(own.0, own.1), Mark::Stems, points)
        })
        .collect()
}
