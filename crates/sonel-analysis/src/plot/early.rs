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

/// Arrivals of source `s` at receiver `r`: of one band, or of all, weighted by the power of the source. [`None`] where none is listed.
#[must_use]
pub fn early(response: &Response, (s, r): (usize, usize), band: Option<usize>) -> Option<Panel> {
    let arrivals = listed(response, (s, r), band);
    let highest = arrivals.iter().map(|arrival| arrival.point.y).max_by(f64::total_cmp)?;
    let first = arrivals.iter().map(|arrival| arrival.point.x).filter(|delay| *delay > 0.0);
    let last = SHOWN_MS.max(BEYOND * first.fold(f64::INFINITY, f64::min).min(f64::from(u32::MAX)));
    let of_all = "all bands".to_owned();
    let name = band.map_or(of_all, |band| format!("{} Hz", response.center_frequency_hz[band]));
    Some(Panel {
        title: title(&format!("Early reflections, {name}"), response, s, r),
        x: Axis::linear("delay to the direct sound [ms]").from_to(-0.03 * last, last),
        y: Axis::linear("strength of the arrival [dB]").from_to(highest - SHOWN_DB, highest + 3.0),
        series: series(&arrivals),
    })
}

struct Listed {
    /// Number of reflections, and whether it came over an edge.
    class: (u32, bool),
    point: Point,
}

fn listed(response: &Response, (s, r): (usize, usize), band: Option<usize>) -> Vec<Listed> {
    let (arrivals, bands, direct) = (&response.arrivals, response.bands(), response.direct_time(s, r));
    let power = &response.source_power_level_db[s * bands..(s + 1) * bands];
    let weights: Vec<f64> = power.iter().map(|level| libm::exp10(0.1 * level)).collect();
    let of_pair = (0..arrivals.source.len())
        .filter(|&a| (arrivals.source[a] as usize, arrivals.receiver[a] as usize) == (s, r));
    of_pair
        .map(|a| {
            let energy = &arrivals.energy[a * bands..(a + 1) * bands];
            let mean = energy.iter().zip(&weights).map(|(energy, weight)| energy * weight).sum::<f64>();
            let fluence = band.map_or(mean / weights.iter().sum::<f64>(), |band| energy[band]);
            let delay_ms = 1000.0 * (arrivals.time_s[a] - direct);
            let class = (arrivals.order[a], arrivals.kind[a] == ArrivalKind::Edge as u32);
            Listed { class, point: Point::new(delay_ms, strength_db(fluence)) }
        })
        .filter(|arrival| arrival.point.y.is_finite())
        .collect()
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

fn series(arrivals: &[Listed]) -> Vec<Series> {
    let mut classes: Vec<(u32, bool)> = arrivals.iter().map(|arrival| arrival.class).collect();
    classes.sort_unstable();
    classes.dedup();
    classes
        .into_iter()
        .map(|class| {
            let own = arrivals.iter().filter(|arrival| arrival.class == class);
            Series::new(class_name(class.0, class.1), Mark::Stems, own.map(|arrival| arrival.point).collect())
        })
        .collect()
}
