//! Schroeder backward integration of an echogram.
//!
//! Input is *energy* per bin; it is not squared again. Time zero is the direct arrival (distance / c, also when it is
//! blocked); energy before it, which only the width of the bins can put there, counts to time zero. Between bin borders
//! the curve is interpolated linearly in level: exact for exponential decays, whatever the bins. What follows the record
//! is the exponential of [`mod@crate::tail`], the correction C of ISO 3382-1, so an ideal decay is free of truncation
//! bias. A record that holds less than 10 dB of the decay is refused: the rest would be extrapolation.
//!
//! References: [Schroeder1965], [ISO3382-1] (docs/references.md).

use crate::estimate::Unsupported;
use crate::tail::{self, Tail};

/// Most of the energy that the extrapolated tail may hold: 10 dB of the decay must have been recorded.
const LARGEST_TAIL: f64 = 0.1;

/// The level that T30 needs [dB].
const T30_DB: f64 = -35.0;
/// So far below the last level that is evaluated a record should reach [dB].
const BEYOND_DB: f64 = 15.0;

/// Energy per time bin, with the time of the direct sound.
#[derive(Debug, Clone, Copy)]
pub struct Echogram<'a> {
    /// Borders of the bins, one more than `energy`, not descending; bins of no width are ignored [s].
    pub edges: &'a [f64],
    /// Energy per bin, finite and not negative.
    pub energy: &'a [f64],
    /// When the direct sound arrives, or would [s].
    pub direct_time: f64,
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
    /// Ascending, the first is 0 [s].
    times: Vec<f64>,
    /// Energy after each of `times`, in the unit of the echogram; not ascending.
    remaining: Vec<f64>,
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
        let mut remaining = vec![tail.energy; times.len()];
        for bin in (0..energy.len()).rev() {
            remaining[bin] = remaining[bin + 1] + energy[bin];
        }
        remaining[0] += early;
        let curve = Self { times, remaining, tail, direct_time: echogram.direct_time };
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
            tail: Tail { energy, rate, ..self.tail },
            direct_time: self.direct_time,
        }
    }

    /// All energy, the tail included.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.remaining[0]
    }

    /// What follows the record.
    #[must_use]
    pub fn tail(&self) -> Tail {
        self.tail
    }

    /// Length of the record since the direct sound [s].
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// Pieces of the curve in order: (begin, end) [s] and the energy remaining there.
    pub fn pieces(&self) -> impl Iterator<Item = Piece> + '_ {
        self.times.windows(2).zip(self.remaining.windows(2)).map(|(times, remaining)| Piece {
            begin: times[0],
            end: times[1],
            before: remaining[0],
            after: remaining[1],
        })
    }

    /// Energy arriving after `time` since the direct sound [s]; [`None`] beyond the record.
    #[must_use]
    pub fn remaining(&self, time: f64) -> Option<f64> {
        match self.piece_at(time) {
            Some(piece) => Some(piece.at(time)),
            None if time < self.duration() => Some(self.total()),
            None => (time <= self.duration()).then(|| self.remaining[self.remaining.len() - 1]),
        }
    }

    /// The piece that holds `time` since the direct sound [s], its begin included.
    #[must_use]
    pub fn piece_at(&self, time: f64) -> Option<Piece> {
        let next = self.times.partition_point(|&edge| edge <= time);
        (next > 0 && next < self.times.len()).then(|| Piece {
            begin: self.times[next - 1],
            end: self.times[next],
            before: self.remaining[next - 1],
            after: self.remaining[next],
        })
    }

    /// Borders as (time since the direct sound [s], level relative to the start [dB]) as far as there is energy to come.
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
        let within: f64 = self.pieces().map(|piece| piece.integral()).sum();
        (within + self.tail.energy * self.tail.mean_delay()) / self.total()
    }
}

/// The curve between two borders, linear in level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Since the direct sound [s].
    pub begin: f64,
    /// Since the direct sound [s].
    pub end: f64,
    /// Energy after `begin`.
    pub before: f64,
    /// Energy after `end`.
    pub after: f64,
}

impl Piece {
    /// Length [s].
    #[must_use]
    pub fn width(&self) -> f64 {
        self.end - self.begin
    }

    /// Decay rate of the remaining energy [1/s]; [`None`] where nothing remains, and the energy of the piece counts as
    /// spread evenly.
    #[must_use]
    pub fn rate(&self) -> Option<f64> {
        let nepers = || {
            let fall = (self.before - self.after) / self.after;
            // A piece may end in next to nothing, and the quotient in infinity.
            if fall.is_finite() { libm::log1p(fall) } else { libm::log(self.before) - libm::log(self.after) }
        };
        (self.after > 0.0).then(|| nepers() / self.width())
    }

    fn at(&self, time: f64) -> f64 {
        let elapsed = time - self.begin;
        match self.rate() {
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
