//! Reverberation times: a straight line through a range of the decay curve.
//!
//! Least squares of level against time, integrated over the curve between the moments where it enters and leaves the range
//! (between bin borders the level is linear). With short bins this is the regression through the borders of ISO 3382-1;
//! with long or unequal ones no border counts more than another for the width of its bins, and the range is met exactly.
//!
//! References: [ISO3382-1], [ISO3382-2] annex B (docs/references.md).

use crate::decay::DecayCurve;
use crate::estimate::Unsupported;

/// A line needs three borders within the range, or it sees a step and no decay.
const FEWEST_BORDERS: usize = 3;
/// ln 10 / 10.
const NEPERS_PER_DB: f64 = core::f64::consts::LN_10 / 10.0;

/// Part of the decay that a time is read from, relative to its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayRange {
    /// Upper limit, at most 0 [dB].
    pub from_db: f64,
    /// Lower limit [dB].
    pub to_db: f64,
}

impl DecayRange {
    /// Early decay time.
    pub const EARLY: Self = Self { from_db: 0.0, to_db: -10.0 };
    /// T20.
    pub const T20: Self = Self { from_db: -5.0, to_db: -25.0 };
    /// T30.
    pub const T30: Self = Self { from_db: -5.0, to_db: -35.0 };
}

/// A line through the decay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayLine {
    /// Part of the decay that it fits.
    pub range: DecayRange,
    /// Time of a decay by 60 dB at its slope [s].
    pub time: f64,
    /// Non-linearity ξ = 1000 (1 − r²) [‰].
    pub non_linearity_permille: f64,
}

/// Fits a line to `range` of `curve`.
///
/// # Errors
/// When the record ends before the range does, or it lies between too few bin borders.
pub fn fit(curve: &DecayCurve, range: DecayRange) -> Result<DecayLine, Unsupported> {
    let (times, remaining) = curve.points();
    let total = curve.total();
    let energy = |level_db: f64| total * libm::exp(NEPERS_PER_DB * level_db);
    let level = |point: usize| libm::log(remaining[point] / total) / NEPERS_PER_DB;
    // The first point in the range, and the first beyond it.
    let [highest, lowest] = [range.from_db, range.to_db].map(energy);
    let first = remaining.partition_point(|&energy| energy > highest);
    let beyond = remaining.partition_point(|&energy| energy >= lowest);
    let crossing = |point: usize, level_db: f64| {
        let [before, after] = [level(point - 1), level(point)];
        let part = if before > after { (before - level_db) / (before - after) } else { 1.0 };
        times[point - 1] + part * (times[point] - times[point - 1])
    };
    let begin = if first == 0 { times[0] } else { crossing(first.min(times.len() - 1), range.from_db) };
    let borders = |end: f64| {
        let borders = curve.borders();
        borders
            .partition_point(|border| *border <= end)
            .saturating_sub(borders.partition_point(|border| *border < begin))
    };
    let steep = |borders| Unsupported::TooSteep { from_db: range.from_db, to_db: range.to_db, borders };
    match remaining.get(beyond) {
        // The last energy falls within one bin, from above the range to nothing.
        Some(energy) if *energy <= 0.0 => {
            return Err(steep(borders(times[beyond - 1]).min(FEWEST_BORDERS - 1)));
        }
        Some(_) => {}
        None => {
            return Err(Unsupported::RangeNotReached {
                reached_db: level(times.len() - 1),
                needed_db: range.to_db,
                needed_s: curve.duration_to_reach(range.to_db),
            });
        }
    }
    let end = crossing(beyond, range.to_db);
    if borders(end) < FEWEST_BORDERS {
        return Err(steep(borders(end)));
    }
    let (middle, level_middle) = (0.5 * (begin + end), 0.5 * (range.from_db + range.to_db));
    let mut sums = RegressionSums::default();
    let mut before = (begin - middle, range.from_db - level_middle);
    let inside = (first..beyond).map(|point| (times[point] - middle, level(point) - level_middle));
    for at in inside.chain([(end - middle, range.to_db - level_middle)]) {
        sums.add(before, at);
        before = at;
    }
    Ok(sums.line(range))
}

/// Integrals over time of a piecewise linear level.
#[derive(Default)]
struct RegressionSums {
    span: f64,
    time: f64,
    level: f64,
    time_time: f64,
    time_level: f64,
    level_level: f64,
}

impl RegressionSums {
    fn add(&mut self, (t1, l1): (f64, f64), (t2, l2): (f64, f64)) {
        let width = t2 - t1;
        // Most pieces are steps.
        if width <= 0.0 {
            return;
        }
        self.span += width;
        self.time += width * 0.5 * (t1 + t2);
        self.level += width * 0.5 * (l1 + l2);
        self.time_time += width * (t1 * t1 + t1 * t2 + t2 * t2) / 3.0;
        self.level_level += width * (l1 * l1 + l1 * l2 + l2 * l2) / 3.0;
        self.time_level += width * (2.0 * t1 * l1 + t1 * l2 + t2 * l1 + 2.0 * t2 * l2) / 6.0;
    }

    fn line(&self, range: DecayRange) -> DecayLine {
        let time_variance = self.time_time - self.time * self.time / self.span;
        let level_variance = self.level_level - self.level * self.level / self.span;
        let covariance = self.time_level - self.time * self.level / self.span;
        let unexplained = 1.0 - covariance * covariance / (time_variance * level_variance);
        DecayLine {
            range,
            time: -60.0 * time_variance / covariance,
            // Rounding may put a perfect line a little above r² = 1.
            non_linearity_permille: 1000.0 * unexplained.max(0.0),
        }
    }
}
