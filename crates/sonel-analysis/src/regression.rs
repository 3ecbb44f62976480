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
    let points = clip(curve, range)?;
    let middle = 0.5 * (points[0].0 + points[points.len() - 1].0);
    let level_middle = 0.5 * (range.from_db + range.to_db);
    let mut sums = Moments::default();
    for pair in points.windows(2) {
        let [start, end] = [pair[0], pair[1]].map(|(time, level)| (time - middle, level - level_middle));
        sums.add(start, end);
    }
    Ok(sums.line(range))
}

/// The part of the curve inside the range, its ends included: (time [s], level [dB]).
fn clip(curve: &DecayCurve, range: DecayRange) -> Result<Vec<(f64, f64)>, Unsupported> {
    let mut points = Vec::new();
    let mut before = (0.0, 0.0);
    for (index, at) in curve.levels_db().enumerate() {
        if at.1 <= range.from_db && points.is_empty() {
            let crossing = if index == 0 { at } else { crossing(before, at, range.from_db) };
            points.push(crossing);
        }
        if at.1 < range.to_db {
            points.push(crossing(before, at, range.to_db));
            let borders = borders_along(curve, &points);
            return enough(points, borders, range);
        }
        if at.1 <= range.from_db && points.last() != Some(&at) {
            points.push(at);
        }
        before = at;
    }
    if ends_in_silence(curve) {
        let borders = borders_along(curve, &points).min(FEWEST_BORDERS - 1);
        return enough(points, borders, range);
    }
    Err(Unsupported::RangeNotReached {
        reached_db: before.1,
        needed_db: range.to_db,
        needed_s: curve.duration_to_reach(range.to_db),
    })
}

/// Number of bin borders between the first and the last of `points`.
fn borders_along(curve: &DecayCurve, points: &[(f64, f64)]) -> usize {
    let [Some((from, _)), Some((to, _))] = [points.first(), points.last()] else { return 0 };
    curve.borders().iter().filter(|border| (from..=to).contains(border)).count()
}

/// Whether the last energy falls within one bin, from above the range to nothing.
fn ends_in_silence(curve: &DecayCurve) -> bool {
    curve.levels_db().count() <= curve.pieces().count()
}

fn enough(
    points: Vec<(f64, f64)>,
    borders: usize,
    range: DecayRange,
) -> Result<Vec<(f64, f64)>, Unsupported> {
    if borders >= FEWEST_BORDERS {
        return Ok(points);
    }
    Err(Unsupported::TooSteep { from_db: range.from_db, to_db: range.to_db, borders })
}

/// Time at which the line from `before` to `after` passes `level`.
fn crossing(before: (f64, f64), after: (f64, f64), level: f64) -> (f64, f64) {
    let fall = before.1 - after.1;
    let part = if fall > 0.0 { (before.1 - level) / fall } else { 1.0 };
    (before.0 + part * (after.0 - before.0), level)
}

/// Integrals over time of a piecewise linear level.
#[derive(Default)]
struct Moments {
    span: f64,
    time: f64,
    level: f64,
    time_time: f64,
    time_level: f64,
    level_level: f64,
}

impl Moments {
    fn add(&mut self, (t1, l1): (f64, f64), (t2, l2): (f64, f64)) {
        let width = t2 - t1;
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
