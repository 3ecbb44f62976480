//! Tests whether a cell differs beyond noise.

use std::collections::BTreeMap;

use super::cell::CellStatistics;
use super::estimation::Frame;
use super::moments::Moments;
use super::{CellDifference, FEWEST_ARRIVALS, PlaceKind, Tier};
use crate::comparison::{FAMILY_LEVEL, ROUNDING};
use crate::student;

/// Kinds of places, which share the level of the comparison.
const KINDS: f64 = 3.0;

/// Tests the cells of one kind, given by source as `[place][window][band]`.
pub(super) fn test_cells(
    kind: PlaceKind,
    frame: &Frame<'_>,
    sources: &[(String, Vec<CellStatistics>)],
) -> Tier {
    let mut dense = Vec::new();
    let (mut sparse, mut sparse_energy) = (0, 0.0_f64);
    let per_place = frame.window_ends.len() * frame.bands.len();
    for (source, cells) in sources {
        let mut all = vec![0.0; frame.bands.len()];
        let mut unseen = all.clone();
        for (index, cell) in cells.iter().enumerate() {
            if frame.places.list[index / per_place].kind() != kind {
                continue;
            }
            let band = index % frame.bands.len();
            let energy = cell.sides[0].mean() + cell.sides[1].mean();
            all[band] += energy;
            if cell.arrivals(frame.alike).into_iter().all(|arrivals| arrivals >= FEWEST_ARRIVALS) {
                dense.push((source, index, cell));
            } else {
                sparse += 1;
                unseen[band] += energy;
            }
        }
        let part = |(unseen, all): (&f64, &f64)| if *all > 0.0 { unseen / all } else { 0.0 };
        sparse_energy = unseen.iter().zip(&all).map(part).fold(sparse_energy, f64::max);
    }
    let level = FAMILY_LEVEL / KINDS / dense.len().max(1) as f64;
    let mut quantiles = BTreeMap::new();
    let mut quantile = |level: f64, freedom: u32| {
        *quantiles.entry((level.to_bits(), freedom)).or_insert_with(|| student::quantile(level, freedom))
    };
    let cells = dense
        .into_iter()
        .filter_map(|(source, index, cell)| {
            let joint = cell.error()?;
            let incident = cell.sides.each_ref().map(Moments::mean);
            let rounding = ROUNDING * incident[0].max(incident[1]);
            let critical = quantile(level, joint.freedom) * joint.sigma + rounding;
            let ratio = cell.level(joint);
            let mut half = |sigma_db: f64| quantile(student::MISSED, joint.freedom) * sigma_db;
            let window = index / frame.bands.len() % frame.window_ends.len();
            let begin = if window == 0 { 0.0 } else { frame.window_ends[window - 1] };
            Some(CellDifference {
                source: source.clone(),
                place: frame.places.list[index / per_place].clone(),
                center_frequencies_hz: frame.bands[index % frame.bands.len()].center_frequencies_hz.clone(),
                window: [begin, frame.window_ends[window]],
                incident,
                sigma: joint.sigma,
                freedom: joint.freedom,
                ratio_db: ratio.map(|(value, _)| value),
                interval_db: ratio.map(|(value, sigma)| (value, half(sigma))).map(|(v, h)| [v - h, v + h]),
                arrivals: cell.arrivals(frame.alike),
                critical,
                differs: (incident[1] - incident[0]).abs() > critical,
            })
        })
        .collect();
    Tier { kind, cells, sparse, sparse_energy, level }
}
