//! Options of a trace.

use crate::study::target::Targets;
use sonel_map::{Mode, Settings, ShardRange, Spectral};
use sonel_scene::LONGEST_DURATION;

use crate::feasible::wrong_limits;
use crate::{Effects, Error, Map, Result, Variants};

/// Options of a trace; those that are none have the default stated here.
#[derive(Debug, Clone, Default)]
pub struct TraceOptions<'a> {
    /// Emissions per source, and per band with [`Spectral::PerBand`]: at least 1. By default 16 000, with `decision` those of its map.
    /// With `shard` those of all shards, with `extend` those of the whole new map, with `until` the maximum.
    pub packets: Option<u64>,
    /// Seed of every random number; by default 1.
    pub seed: Option<u64>,
    /// Batches whose spread gives the intervals, 1 … 4096; by default 32.
    pub batches: Option<u32>,
    /// Survival exponent β, 0 (no roulette) … 1; by default 0.15.
    pub survival: Option<f64>,
    /// Method; by default [`Mode::Accurate`].
    pub mode: Option<Mode>,
    /// Whether bands share paths; by default [`Spectral::Shared`].
    pub spectral: Option<Spectral>,
    /// Length of the echograms [s], above 0 and at most 3600; by default that of the scene.
    pub duration: Option<f64>,
    /// The part of the run that is traced; by default all of it. Not with `extend` or `until`.
    pub shard: Option<ShardRange>,
    /// Materials that the map carries besides.
    pub variants: Vec<Variants>,
    /// A map of the same scene that is continued with its own settings: the result is the map of the longer run, byte for byte.
    pub extend: Option<&'a Map>,
    /// A map of the same scene, mode and duration whose decision about effects is used, and its number of packets unless `packets` states one. Not with `effects` or `extend`.
    pub decision: Option<&'a Map>,
    /// Simulated effects; by default [`Effects::auto`].
    pub effects: Option<Effects>,
    /// Adds packets until the intervals are as narrow as this.
    pub until: Option<Targets>,
    /// Limit of `until` and of plans [s], by the observer's clock; another run that is predicted to take longer on all cores is refused.
    pub at_most: Option<f64>,
    /// Own memory that the run may take [bytes]: one that is predicted to take more is refused. Not for `until`.
    pub memory: Option<f64>,
}

/// Most batches of a run: t of a 95 % interval is within 0.1 % of its limit. Readers hold sums for each.
const MOST_BATCHES: u32 = 4096;

impl TraceOptions<'_> {
    /// The settings of the run.
    ///
    /// # Errors
    /// One sentence per option that is out of range or contradicts the mode.
    pub fn settings(&self) -> Result<Settings> {
        let problems = self.problems();
        if !problems.is_empty() {
            return Err(Error::Options(problems));
        }
        let paper = self.mode == Some(Mode::Paper);
        let defaults = Settings::default();
        Ok(Settings {
            emissions: self.packets.unwrap_or(defaults.emissions),
            seed: self.seed.unwrap_or(defaults.seed),
            batches: self.batches.unwrap_or(defaults.batches),
            survival: self.survival.unwrap_or(if paper { 1.0 } else { defaults.survival }),
            spectral: if paper { Spectral::PerBand } else { self.spectral.unwrap_or(Spectral::Shared) },
            mode: self.mode.unwrap_or(defaults.mode),
        })
    }

    fn problems(&self) -> Vec<String> {
        let is_longer = self.extend.is_some() && (self.packets.is_some() || self.until.is_some());
        let paper = self.mode == Some(Mode::Paper);
        let survival = self.survival.filter(|survival| !(0.0..=1.0).contains(survival));
        let duration = self.duration.filter(|&duration| !(duration > 0.0 && duration <= LONGEST_DURATION));
        let batches = self.batches.filter(|batches| !(1..=MOST_BATCHES).contains(batches));
        let [memory, at_most] = wrong_limits(self.memory, self.at_most);
        let when = |wrong: bool, sentence: &str| wrong.then(|| sentence.to_owned());
        let problems = [
            survival.map(|survival| format!("`survival` {survival} is outside 0 … 1")),
            when(
                paper && self.survival.is_some_and(|survival| survival < 1.0),
                "`mode` paper means `survival` 1: omit `survival` or use `mode` accurate",
            ),
            when(
                paper && self.spectral == Some(Spectral::Shared),
                "`mode` paper means `spectral` per-band: omit `spectral` or use `mode` accurate",
            ),
            duration.map(|duration| {
                format!("`duration` {duration} s is outside the allowed range: give a number above 0 and at most {LONGEST_DURATION} s")
            }),
            batches.map(|batches| format!("`batches` {batches} is outside 1 … {MOST_BATCHES}")),
            memory,
            at_most,
            when(
                self.extend.is_some() && !is_longer,
                "`extend` needs `packets` N: those of the whole new map",
            ),
            when(
                self.extend.is_some() && self.shard.is_some(),
                "`extend` and `shard` cannot be combined: trace the shards of the longer run, or omit `shard`",
            ),
            when(
                self.decision.is_some() && (self.effects.is_some() || self.extend.is_some()),
                "`decision` cannot be combined with `effects` or `extend`",
            ),
            when(
                self.until.is_some() && self.shard.is_some(),
                "`until` and `shard` cannot be combined: find N with `plan`, then trace shards",
            ),
            when(self.packets == Some(0), "`packets` 0 traces nothing: give at least 1"),
        ];
        problems.into_iter().flatten().collect()
    }

    /// The part of the run.
    pub(crate) fn shard_range(&self) -> ShardRange {
        self.shard.unwrap_or(ShardRange::WHOLE)
    }
}
