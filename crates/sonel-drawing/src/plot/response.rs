//! Echogram and decay of a source at a receiver, a series a band.

use rayon::prelude::*;
use sonel_echogram::Response;

use super::{Axis, Mark, Panel, Point, Series};
use sonel_analysis::batches::{Parts, weighted};
use sonel_analysis::decay::{DecayCurve, Echogram};
use sonel_analysis::jackknife;
use sonel_analysis::listed;
use sonel_analysis::student;

/// What is shown below the highest level [dB].
const SHOWN_DB: f64 = 70.0;
/// Bins and points along the time axis at the most: what an eye can tell apart.
const POINTS: usize = 250;

/// Fluence rate per unit emitted energy of source `s` at receiver `r` over the time since emission, per band, from the coarse bins of the batches; from
/// the fine bins where the response holds no batches, without intervals then.
#[must_use]
pub fn echogram(response: &Response, s: usize, r: usize) -> Panel {
    let series: Vec<Series> = bands(response, |b| {
        let (edges, estimates) = coarse(response, s, r, b).unwrap_or_else(|| fine(response, s, r, b));
        edges
            .windows(2)
            .zip(estimates)
            .filter(|(edge, _)| edge[1] > edge[0])
            .map(|(edge, (energy, half_width))| {
                let rate_db = |energy: f64| 10.0 * libm::log10(energy / (edge[1] - edge[0]));
                let interval = half_width.map(|half| [(energy - half).max(0.0), energy + half].map(rate_db));
                Point { x: 0.5 * (edge[0] + edge[1]), y: rate_db(energy), interval }
            })
            .collect()
    });
    let values = series.iter().flat_map(|series| &series.points).map(|point| point.y);
    let highest = values.filter(|y| y.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    let y = Axis::linear("fluence rate [dB re 1/(m² s)]");
    let y = if highest.is_finite() { y.from_to(highest - SHOWN_DB, highest + 5.0) } else { y };
    Panel { title: title("Echogram", response, s, r), x: Axis::linear("time since emission [s]"), y, series }
}

/// Energy still to come of source `s` at receiver `r` over the time since the direct sound, per band.
#[must_use]
pub fn decay(response: &Response, s: usize, r: usize) -> Panel {
    let (direct_time, listed) = (response.direct_time(s, r), listed::Index::new(response));
    let series = bands(response, |b| {
        let (edges, energy) = (&response.time_edges_s, response.echogram(s, r, b));
        let arrivals = listed.of(response, s, r, b);
        let echogram = Echogram { edges, energy, direct_time, arrivals: &arrivals };
        let Ok(curve) = DecayCurve::new(echogram) else { return Vec::new() };
        // Levels relative to the start need no scale.
        let parts = Parts::read(response, s, r, b, &arrivals, None).ok();
        let times = (0..=POINTS).map(|i| curve.duration() * i as f64 / POINTS as f64);
        times
            .map(|time| {
                let y = level_db(&curve, time).unwrap_or(f64::NAN);
                let half_width = parts.as_ref().and_then(|parts| half_width(parts, time));
                Point { x: time, y, interval: half_width.map(|half| [y - half, y + half]) }
            })
            .collect()
    });
    Panel {
        title: title("Decay", response, s, r),
        x: Axis::linear("time since the direct sound [s]"),
        y: Axis::linear("Schroeder decay curve [dB]").from_to(-SHOWN_DB, 2.0),
        series,
    }
}

fn bands(response: &Response, points: impl Fn(usize) -> Vec<Point> + Sync) -> Vec<Series> {
    let name = |b: usize| format!("{} Hz", response.center_frequency_hz[b]);
    (0..response.bands()).into_par_iter().map(|b| Series::new(name(b), Mark::Line, points(b))).collect()
}

pub(super) fn title(what: &str, response: &Response, s: usize, r: usize) -> String {
    format!("{what}: \"{}\" at \"{}\"", response.source_names[s], response.receiver_names[r])
}

fn level_db(curve: &DecayCurve, time: f64) -> Option<f64> {
    Some(10.0 * libm::log10(curve.remaining(time)? / curve.total()))
}

/// Half of the 95 % interval of the decay at `time`, where every part of the batches reaches so far.
fn half_width(parts: &Parts, time: f64) -> Option<f64> {
    let all = level_db(parts.readings.all.curve.as_ref().ok()?, time)?;
    let without: Vec<f64> = parts
        .readings
        .without
        .iter()
        .map(|values| level_db(values.curve.as_ref().ok()?, time).filter(|level| level.is_finite()))
        .collect::<Option<_>>()?;
    all.is_finite().then(|| jackknife::spread(all, &without, &parts.weight).half_width)
}

/// Borders, and energy with the half of its interval between them.
type Bins = (Vec<f64>, Vec<(f64, Option<f64>)>);

/// The coarse bins of the batches: their weighted mean, and Student's interval of it.
fn coarse(response: &Response, s: usize, r: usize, b: usize) -> Option<Bins> {
    let stored = response.batches.as_ref()?;
    let edges = response.batch_edges(s, r)?;
    let rows: Vec<(f64, &[f32])> =
        weighted(&stored.weight, |g| response.batch_echogram(g, s, r, b)).collect();
    let quantile = (rows.len() > 1).then(|| student::quantile(student::MISSED, rows.len() as u32 - 1));
    let bins = (0..stored.bins).map(|bin| {
        let mean: f64 = rows.iter().map(|(weight, row)| weight * f64::from(row[bin])).sum();
        // The variance of a batch goes with 1/weight: Σ w (e − mean)² / (G − 1) estimates that of the mean.
        let square = |(weight, row): &(f64, &[f32])| {
            let difference = f64::from(row[bin]) - mean;
            weight * difference * difference
        };
        let variance = rows.iter().map(square).sum::<f64>() / (rows.len() as f64 - 1.0);
        (mean, quantile.map(|quantile| quantile * variance.sqrt()))
    });
    Some((edges.to_vec(), bins.collect()))
}

/// The fine bins, joined so that an eye can tell them apart.
fn fine(response: &Response, s: usize, r: usize, b: usize) -> Bins {
    let joined = response.bins().div_ceil(POINTS).max(1);
    let energy = response.echogram(s, r, b).chunks(joined);
    let last = response.time_edges_s.last().copied();
    let edges = response.time_edges_s.iter().step_by(joined).copied().chain(last);
    (edges.collect(), energy.map(|bins| (bins.iter().sum(), None)).collect())
}
