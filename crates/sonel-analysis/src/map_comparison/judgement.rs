//! Whether a cell differs beyond noise.

use std::collections::BTreeMap;
use std::f64::consts::LN_10;

use super::estimation::Frame;
use super::moments::Moments;
use super::{CellDifference, FEWEST_ARRIVALS, Kind, Tier};
use crate::comparison::{FAMILY_LEVEL, INTERVAL_LEVEL, ROUNDING, welch};
use crate::estimate::StandardError;
use crate::student;

/// Kinds of places, which share the level of the comparison.
const KINDS: f64 = 3.0;

/// What both maps say about one cell.
#[derive(Debug, Clone)]
pub struct Cell {
    /// Incident energy in A and in B over their batches.
    pub sides: [Moments; 2],
    /// B − A batch by batch, where both have the same random numbers.
    pub paired: Option<Moments>,
    /// Σ of the arrivals in units of a packet.
    pub arrived: [f64; 2],
    /// Σ of their squares.
    pub squared: [f64; 2],
    /// Packets that may have arrived.
    pub packets: [f64; 2],
}

impl Cell {
    /// An empty cell.
    pub fn new(paired: bool) -> Self {
        Self {
            sides: [Moments::default(); 2],
            paired: paired.then(Moments::default),
            arrived: [0.0; 2],
            squared: [0.0; 2],
            packets: [0.0; 2],
        }
    }

    /// Effective number of arrivals in either map, by Kish's sample size [Kish1965]: where packets of both weigh `alike`,
    /// what is expected of maps of one scene, shared out by packets; else what each has.
    fn arrivals(&self, alike: bool) -> [f64; 2] {
        let effective =
            |arrived: f64, squared: f64| if squared > 0.0 { arrived * arrived / squared } else { 0.0 };
        if !alike {
            return [0, 1].map(|side| effective(self.arrived[side], self.squared[side]));
        }
        let all = effective(self.arrived[0] + self.arrived[1], self.squared[0] + self.squared[1]);
        self.packets.map(|packets| all * packets / (self.packets[0] + self.packets[1]))
    }

    /// Standard error of B − A.
    fn error(&self) -> Option<StandardError> {
        if let Some(paired) = &self.paired {
            return paired.error();
        }
        Some(welch(self.sides[0].error()?, self.sides[1].error()?))
    }

    /// B over A and its standard error [dB], by the first order of the logarithm.
    fn level(&self, joint: StandardError) -> Option<(f64, f64)> {
        let [a, b] = self.sides.each_ref().map(Moments::mean);
        if a <= 0.0 || b <= 0.0 {
            return None;
        }
        let [var_a, var_b] =
            [self.sides[0].error()?, self.sides[1].error()?].map(|error| error.sigma * error.sigma);
        let covariance =
            if self.paired.is_some() { 0.5 * (var_a + var_b - joint.sigma * joint.sigma) } else { 0.0 };
        let variance = var_a / (a * a) + var_b / (b * b) - 2.0 * covariance / (a * b);
        Some((10.0 * libm::log10(b / a), 10.0 / LN_10 * variance.max(0.0).sqrt()))
    }
}

/// Judges the cells of one kind, given by source as `[place][window][band]`.
pub fn judge(kind: Kind, frame: &Frame<'_>, sources: &[(String, Vec<Cell>)]) -> Tier {
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
            let mut half = |sigma_db: f64| quantile(INTERVAL_LEVEL, joint.freedom) * sigma_db;
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
