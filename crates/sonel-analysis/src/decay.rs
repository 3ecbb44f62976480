//! Schroeder backward integration of an echogram.
//!
//! Input is *energy* per bin; it is not squared again. Time zero is the direct arrival (distance / c, also when it is
//! blocked); energy before it, which only the width of the bins can put there, counts to time zero. The curve falls by a
//! step at every listed arrival ([`mod@crate::listed`]); what the bins hold besides is interpolated linearly in level between
//! their borders: exact for exponential decays, whatever the bins. What follows the record
//! is the exponential of [`mod@crate::tail`], the correction C of ISO 3382-1, so an ideal decay is free of truncation
//! bias. A record that holds less than 10 dB of the decay is refused: the rest would be extrapolation.
//!
//! References: [Schroeder1965], [ISO3382-1] (docs/references.md).

use crate::estimate::Unsupported;
use crate::listed::{self, Arrival};
use crate::tail::{self, Tail};

/// Most of the energy that the extrapolated tail may hold: 10 dB of the decay must have been recorded.
const LARGEST_TAIL: f64 = 0.1;

/// The level that T30 needs [dB].
const T30_DB: f64 = -35.0;
/// So far below the last level that is evaluated a record should reach [dB].
const BEYOND_DB: f64 = 15.0;

/// Below it what the series of 2 artanh u leaves out is rounding: u⁸/9.
const LITTLE_FALL: f64 = 0.015;

/// Energy per time bin, with the time of the direct sound.
#[derive(Debug, Clone, Copy)]
pub struct Echogram<'a> {
    /// Borders of the bins, one more than `energy`, not descending; bins of no width are ignored [s].
    pub edges: &'a [f64],
    /// Energy per bin, finite and not negative.
    pub energy: &'a [f64],
    /// When the direct sound arrives, or would [s].
    pub direct_time: f64,
    /// The part of `energy` whose times are known, ascending in time.
    pub arrivals: &'a [Arrival],
}

impl Echogram<'_> {
    /// Energy of the whole record.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.energy.iter().sum()
    }
}

/// Energy still to come, against time since the direct sound.
#[derive(Debug, Clone, PartialEq)]
pub struct DecayCurve {
    /// Not descending, the first is 0; twice the same at a step [s].
    times: Vec<f64>,
    /// Energy after each of `times`, in the unit of the echogram; not ascending.
    remaining: Vec<f64>,
    /// Borders of the bins, ascending, the first is 0 [s].
    borders: Vec<f64>,
    tail: Tail,
    /// When the direct sound arrives, from the emission [s].
    direct_time: f64,
}

impl DecayCurve {
    /// Integrates `echogram` from its end.
    ///
    /// # Errors
    /// When it holds no energy, ends before the direct sound, does not decay towards its end, or holds less than 10 dB of
    /// the decay.
    pub fn new(echogram: Echogram<'_>) -> Result<Self, Unsupported> {
        let end = echogram.edges.last().copied().unwrap_or(0.0);
        if echogram.direct_time >= end {
            return Err(Unsupported::DirectOutside { direct_time: echogram.direct_time, end });
        }
        if echogram.total() <= 0.0 {
            return Err(Unsupported::NoEnergy);
        }
        let (times, energy, early) = since_direct(echogram);
        if energy.iter().all(|&energy| energy <= 0.0) {
            return Err(Unsupported::NoReverberation);
        }
        let tail = tail::fit(&times, &energy)?;
        let (points, remaining) = integrated(echogram, &times, energy, early, tail.energy);
        let curve =
            Self { times: points, remaining, borders: times, tail, direct_time: echogram.direct_time };
        let share = curve.tail.energy / curve.total();
        if share > LARGEST_TAIL {
            let reached_db = -10.0 * libm::log10(share);
            let needed_s = curve.duration_to_reach(T30_DB);
            return Err(Unsupported::RecordTooShort { reached_db, needed_s });
        }
        Ok(curve)
    }

    /// Duration of a run [s], from the emission, whose record reaches `level_db` and 15 dB more, so that the tail is small, if the decay
    /// goes on as at the end.
    #[must_use]
    pub fn duration_to_reach(&self, level_db: f64) -> f64 {
        let reached_db = 10.0 * libm::log10(self.tail.energy / self.total());
        let missing_nepers = (reached_db - level_db + BEYOND_DB) * core::f64::consts::LN_10 / 10.0;
        self.direct_time + self.duration() + missing_nepers.max(0.0) / self.tail.rate
    }

    /// The same record followed by another tail.
    #[must_use]
    pub fn with_tail(&self, energy: f64, rate: f64) -> Self {
        let more = energy - self.tail.energy;
        Self {
            times: self.times.clone(),
            remaining: self.remaining.iter().map(|remaining| (remaining + more).max(0.0)).collect(),
            borders: self.borders.clone(),
            tail: Tail { energy, rate },
            direct_time: self.direct_time,
        }
    }

    /// All energy, the tail included.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.remaining[0]
    }

    /// Energy after the record.
    #[must_use]
    pub fn tail(&self) -> Tail {
        self.tail
    }

    /// When the direct sound arrives, or would, from the emission [s].
    #[must_use]
    pub fn direct_time(&self) -> f64 {
        self.direct_time
    }

    /// Length of the record since the direct sound [s].
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// Borders of the pieces since the direct sound, ascending [s], and the energy remaining there.
    pub(crate) fn points(&self) -> (&[f64], &[f64]) {
        (&self.times, &self.remaining)
    }

    /// Pieces of the curve in order: (begin, end) [s] and the energy remaining there.
    pub fn pieces(&self) -> impl Iterator<Item = DecayPiece> + '_ {
        self.times.windows(2).zip(self.remaining.windows(2)).map(|(times, remaining)| DecayPiece {
            begin: times[0],
            end: times[1],
            before: remaining[0],
            after: remaining[1],
        })
    }

    /// Energy arriving at `time` since the direct sound [s] or later; [`None`] beyond the record.
    #[must_use]
    pub fn remaining(&self, time: f64) -> Option<f64> {
        let next = self.times.partition_point(|&point| point < time);
        let remaining = *self.remaining.get(next)?;
        if next == 0 || self.times[next] <= time {
            return Some(remaining);
        }
        let (begin, before) = (self.times[next - 1], self.remaining[next - 1]);
        let piece = DecayPiece { begin, end: self.times[next], before, after: remaining };
        Some(piece.at(piece.rate(), time))
    }

    /// Borders of the bins since the direct sound, ascending, the first is 0 [s].
    #[must_use]
    pub fn borders(&self) -> &[f64] {
        &self.borders
    }

    /// Points of the curve as (time since the direct sound [s], level relative to the start [dB]) as far as there is energy to come.
    pub fn levels_db(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let total = self.total();
        self.times
            .iter()
            .zip(&self.remaining)
            .take_while(|(_, remaining)| **remaining > 0.0)
            .map(move |(&time, &remaining)| (time, 10.0 * libm::log10(remaining / total)))
    }

    /// Centre time Ts: the mean arrival time since the direct sound, ∫S dt / S(0) [s].
    #[must_use]
    pub fn center_time(&self) -> f64 {
        let within: f64 =
            self.pieces().filter(|piece| piece.width() > 0.0).map(|piece| piece.integral()).sum();
        // The mean delay of an exponential is one over its rate.
        (within + self.tail.energy * (1.0 / self.tail.rate)) / self.total()
    }
}

/// The curve between two points, linear in level; of no width at a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayPiece {
    /// Since the direct sound [s].
    pub begin: f64,
    /// Since the direct sound [s].
    pub end: f64,
    /// Energy after `begin`.
    pub before: f64,
    /// Energy after `end`.
    pub after: f64,
}

impl DecayPiece {
    /// Length [s].
    #[must_use]
    pub fn width(&self) -> f64 {
        self.end - self.begin
    }

    /// Decay rate of the remaining energy [1/s], infinite at a step; [`None`] where nothing remains, and the energy of the piece counts as
    /// spread evenly.
    #[must_use]
    pub fn rate(&self) -> Option<f64> {
        let nepers = || {
            let u = (self.before - self.after) / (self.before + self.after);
            if u < LITTLE_FALL {
                let square = u * u;
                return 2.0 * u * (1.0 + square * (1.0 / 3.0 + square * (0.2 + square / 7.0)));
            }
            let fall = (self.before - self.after) / self.after;
            // A piece may end in next to nothing, and the quotient in infinity.
            if fall.is_finite() { libm::log1p(fall) } else { libm::log(self.before) - libm::log(self.after) }
        };
        (self.after > 0.0).then(|| nepers() / self.width())
    }

    /// Energy after a `time` within the piece, whose decay rate is known.
    fn at(&self, rate: Option<f64>, time: f64) -> f64 {
        let elapsed = time - self.begin;
        match rate {
            Some(rate) => self.before * libm::exp(-rate * elapsed),
            None => self.before * (1.0 - elapsed / self.width()),
        }
    }

    /// ∫S dt over the piece.
    fn integral(&self) -> f64 {
        match self.rate() {
            Some(rate) if rate > 0.0 => (self.before - self.after) / rate,
            Some(_) => self.before * self.width(),
            None => 0.5 * self.before * self.width(),
        }
    }
}

/// Borders since the direct sound, energy between them, and the energy of the bins that end before it.
fn since_direct(echogram: Echogram<'_>) -> (Vec<f64>, Vec<f64>, f64) {
    let (mut times, mut energy, mut early) = (vec![0.0], Vec::new(), 0.0);
    for (edges, &bin) in echogram.edges.windows(2).zip(echogram.energy) {
        let end = edges[1] - echogram.direct_time;
        if end <= 0.0 {
            early += bin;
        } else if edges[1] > edges[0] {
            times.push(end);
            energy.push(bin);
        }
    }
    (times, energy, early)
}

/// Points in time since the direct sound [s] and the energy that remains there: of bins of `energy` between `borders`, whose
/// listed arrivals are steps, `early` energy at time zero and a `tail`.
fn integrated(
    echogram: Echogram<'_>,
    borders: &[f64],
    mut energy: Vec<f64>,
    early: f64,
    tail: f64,
) -> (Vec<f64>, Vec<f64>) {
    let mut steps = vec![Arrival { time: 0.0, energy: early }];
    steps.extend(listed::take(echogram.arrivals, echogram.direct_time, borders, &mut energy));
    let spread = remaining_after(tail, &energy);
    let listed = remaining_after(0.0, &steps.iter().map(|step| step.energy).collect::<Vec<f64>>());
    let (mut times, mut remaining): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut push = |time: f64, energy: f64| {
        if times.last() != Some(&time) || remaining.last() != Some(&energy) {
            times.push(time);
            remaining.push(energy);
        }
    };
    let mut next = 0;
    for (times, spread) in borders.windows(2).zip(spread.windows(2)) {
        let piece = DecayPiece { begin: times[0], end: times[1], before: spread[0], after: spread[1] };
        push(piece.begin, piece.before + listed[next]);
        let rate = piece.rate();
        while next < steps.len() && steps[next].time < piece.end {
            let spread = piece.at(rate, steps[next].time);
            push(steps[next].time, spread + listed[next]);
            push(steps[next].time, spread + listed[next + 1]);
            next += 1;
        }
    }
    let end = borders.len() - 1;
    push(borders[end], spread[end] + listed[next]);
    push(borders[end], spread[end]);
    (times, remaining)
}

/// Energy before each of `parts` and after the last, which `rest` follows.
fn remaining_after(rest: f64, parts: &[f64]) -> Vec<f64> {
    let mut remaining = vec![rest; parts.len() + 1];
    for part in (0..parts.len()).rev() {
        remaining[part] = remaining[part + 1] + parts[part];
    }
    remaining
}
