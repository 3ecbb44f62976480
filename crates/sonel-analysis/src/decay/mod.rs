//! Schroeder backward integration of an echogram.
//!
//! Input is *energy* per bin; it is not squared again. Time zero is the exact direct arrival, distance over speed of
//! sound, also when something blocks it; energy booked before it counts to it. Inside a bin the curve is interpolated
//! linearly in decibels, which is exact for exponential decays and puts the energy of a bin where such a decay would.
//!
//! What follows the end of the record is added as the constant C of ISO 3382-1:2009, 5.3.3, where the end of the record
//! lets it be known ([`Tail`]).
//!
//! References: [Schroeder1965], [ISO3382-1] (docs/references.md).

mod regression;
mod tail;

use thiserror::Error;

pub use regression::{DecayFit, DecayRange};
pub use tail::{Tail, TailRefusal};

/// Why an echogram has no decay curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum NoDecay {
    /// No energy at all.
    #[error("no energy arrives in this band")]
    NoEnergy,
    /// The direct sound would arrive after the record's end.
    #[error("the direct sound arrives after the end of the record; simulate a longer duration")]
    DirectBeyondRecord,
}

/// Energy still to come, over time since the direct arrival.
#[derive(Debug, Clone, PartialEq)]
pub struct DecayCurve {
    /// Times since the direct arrival, strictly ascending from 0 (s).
    times: Vec<f64>,
    /// Energy that arrives later than each time, the tail beyond the record included, never rising.
    remaining: Vec<f64>,
    tail: Result<Tail, TailRefusal>,
    recorded: f64,
}

impl DecayCurve {
    /// Integrates `energies` (T) in bins with ascending `edges` (T+1) [s], empty intervals allowed, for a direct arrival at
    /// `direct_time` [s].
    ///
    /// # Errors
    /// [`NoDecay`] when there is nothing to integrate.
    pub fn new(edges: &[f64], energies: &[f64], direct_time: f64) -> Result<Self, NoDecay> {
        let end = edges.last().copied().unwrap_or(0.0);
        if direct_time >= end {
            return Err(NoDecay::DirectBeyondRecord);
        }
        // Backwards, so that the small late energies are added before the large early ones.
        let (mut times, mut remaining, mut sum) = (vec![end - direct_time], vec![0.0], 0.0);
        for (bin, energy) in energies.iter().enumerate().rev() {
            sum += energy;
            let time = (edges[bin] - direct_time).max(0.0);
            if times.last().is_some_and(|later| time < *later) {
                times.push(time);
                remaining.push(sum);
            } else if let Some(last) = remaining.last_mut() {
                *last = sum;
            }
        }
        if sum <= 0.0 {
            return Err(NoDecay::NoEnergy);
        }
        if times.last().is_some_and(|first| *first > 0.0) {
            times.push(0.0);
            remaining.push(sum);
        }
        times.reverse();
        remaining.reverse();
        let tail = tail::fit(&times, &remaining);
        let beyond = tail.map_or(0.0, |tail| tail.energy);
        remaining.iter_mut().for_each(|energy| *energy += beyond);
        Ok(Self { times, remaining, tail, recorded: sum })
    }

    /// Energy of the record, without what lies beyond it.
    #[must_use]
    pub fn recorded_energy(&self) -> f64 {
        self.recorded
    }

    /// Energy of the whole decay, with what lies beyond the record where that is known.
    #[must_use]
    pub fn total_energy(&self) -> f64 {
        self.remaining[0]
    }

    /// End of the record since the direct arrival [s].
    #[must_use]
    pub fn end(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// What lies beyond the record, or why that cannot be told.
    ///
    /// # Errors
    /// The reason for which the record's end is not continued.
    pub fn tail(&self) -> Result<Tail, TailRefusal> {
        self.tail
    }

    /// Times since the direct arrival (s) and the curve's level there (dB re its start), as far as it is finite.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let finite = self.remaining.iter().take_while(|energy| **energy > 0.0).count();
        (0..finite).map(|node| (self.times[node], self.level_db(node)))
    }

    /// How far the curve can be believed to fall (dB, positive).
    ///
    /// With a known tail that is its level at the end of the record. Without, the missing rest bends the curve down, and
    /// callers keep a margin.
    #[must_use]
    pub fn depth_db(&self) -> f64 {
        match self.tail {
            Ok(_) => -self.level_db(self.times.len() - 1),
            Err(TailRefusal::NoEnergy) => self.points().last().map_or(0.0, |(_, level)| -level),
            Err(TailRefusal::TooShort { end_share } | TailRefusal::NotDecaying { end_share }) => {
                -10.0 * libm::log10(end_share)
            }
        }
    }

    /// Energy that arrives later than `time` since the direct arrival [s], within the record.
    #[must_use]
    pub fn energy_after(&self, time: f64) -> f64 {
        let next = self.times.partition_point(|node| *node <= time);
        if next == 0 {
            return self.remaining[0];
        }
        if next == self.times.len() {
            return self.remaining[next - 1];
        }
        let [before, after] = [self.remaining[next - 1], self.remaining[next]];
        let part = (time - self.times[next - 1]) / (self.times[next] - self.times[next - 1]);
        if after > 0.0 { before * libm::pow(after / before, part) } else { before * (1.0 - part) }
    }

    /// First moment of the arrivals over their energy, the centre time [s].
    #[must_use]
    pub fn center_time(&self) -> f64 {
        // ∫ e(t) t dt = ∫ remaining(t) dt.
        let inside: f64 = self.bins().map(|bin| bin.integral()).sum();
        let beyond = self.tail.map_or(0.0, |tail| tail.energy / tail.rate);
        (inside + beyond) / self.total_energy()
    }

    /// Modulation transfer |∫ e(t) e^(−j2πFt) dt| / ∫ e(t) dt at `modulation_frequency` F [Hz], 0…1 [Schroeder1981].
    #[must_use]
    pub fn modulation_transfer(&self, modulation_frequency: f64) -> f64 {
        let angular = 2.0 * std::f64::consts::PI * modulation_frequency;
        let mut sum = self.bins().fold([0.0, 0.0], |sum, bin| {
            let part = bin.transform(angular);
            [sum[0] + part[0], sum[1] + part[1]]
        });
        if let Ok(tail) = self.tail {
            // ∫ k C e^(−(k+jω)t) dt = k C / (k + jω), turned to the end of the record.
            let scale = tail.energy * tail.rate / (tail.rate * tail.rate + angular * angular);
            let (sin, cos) = libm::sincos(angular * self.end());
            sum[0] += scale * (tail.rate * cos - angular * sin);
            sum[1] -= scale * (tail.rate * sin + angular * cos);
        }
        (libm::hypot(sum[0], sum[1]) / self.total_energy()).min(1.0)
    }

    /// Level at a node, relative to the start of the curve [dB].
    fn level_db(&self, node: usize) -> f64 {
        10.0 * libm::log10(self.remaining[node] / self.remaining[0])
    }

    fn bins(&self) -> impl Iterator<Item = Bin> + '_ {
        (1..self.times.len()).map(|node| Bin {
            from: self.times[node - 1],
            width: self.times[node] - self.times[node - 1],
            before: self.remaining[node - 1],
            after: self.remaining[node],
        })
    }
}

/// One bin of the curve: it falls from `before` to `after`, exponentially unless it falls to zero.
#[derive(Debug, Clone, Copy)]
struct Bin {
    from: f64,
    width: f64,
    before: f64,
    after: f64,
}

impl Bin {
    /// Logarithm of the ratio by which the curve falls; 0 for an empty bin.
    fn fall(&self) -> f64 {
        libm::log1p((self.before - self.after) / self.after)
    }

    /// ∫ remaining dt over the bin.
    fn integral(&self) -> f64 {
        if self.after <= 0.0 {
            return 0.5 * self.before * self.width;
        }
        let fall = self.fall();
        let mean = if fall > 0.0 { (self.before - self.after) / fall } else { self.before };
        mean * self.width
    }

    /// ∫ e(t) e^(−jωt) dt over the bin, real and imaginary part.
    fn transform(&self, angular: f64) -> [f64; 2] {
        let energy = self.before - self.after;
        if energy <= 0.0 {
            return [0.0, 0.0];
        }
        let turn = angular * self.width;
        let sin = libm::sin(turn);
        let [re, im] = if self.after > 0.0 {
            // x/(x + jφ) · (before − after·e^(−jφ)), with x the fall and φ the turn.
            let fall = self.fall();
            let scale = fall / (fall * fall + turn * turn);
            // 1 − cos φ by the half angle: the difference of large numbers would cancel.
            let half = libm::sin(0.5 * turn);
            let (re, im) = (energy + 2.0 * self.after * half * half, self.after * sin);
            [scale * (re * fall + im * turn), scale * (im * fall - re * turn)]
        } else if turn > 0.0 {
            // Evenly spread: (1 − e^(−jφ)) / jφ.
            let half = libm::sin(0.5 * turn);
            [energy * sin / turn, -energy * 2.0 * half * half / turn]
        } else {
            [energy, 0.0]
        };
        let (sin, cos) = libm::sincos(angular * self.from);
        [re * cos + im * sin, im * cos - re * sin]
    }
}
