//! The command line of `sonel-trace`.

use std::path::PathBuf;

use anyhow::bail;
use clap::Parser;
use sonel_console::choices::{mode, spectral};
use sonel_console::count::parse_count;
use sonel_console::parse_threads;
use sonel_console::shard::parse_shard;
use sonel_console::time::parse_time;
use sonel_map::{Mode, Settings, ShardRange, Spectral};
use sonel_scene::LONGEST_DURATION;
use sonel_study::effects::EffectSpec;
use sonel_study::target::Targets;

/// Traces sonels through a scene and saves the sonel map.
#[derive(Debug, Clone, Parser)]
pub struct Arguments {
    /// The scene file.
    #[arg(value_name = "SCENE.toml")]
    pub scene: PathBuf,
    /// Where the map goes; replaced only when the new one is complete.
    #[arg(short, long, value_name = "MAP.sonelmap", required_unless_present = "plan")]
    pub output: Option<PathBuf>,
    /// Emissions per source (per source and band with --spectral per-band); with --shard those of all shards, with --extend
    /// those of the whole new map, with --until the most there may be. By default a pilot run chooses
    /// N for 0.05 just-noticeable differences, at least 50k and at most 8 million path segments.
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub sonels: Option<u64>,
    /// Seed of every random number; 1 where none is given.
    #[arg(long, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Batches whose spread gives the intervals; 32 where nothing is given.
    #[arg(long, value_name = "G", value_parser = clap::value_parser!(u32).range(1..=4096), allow_negative_numbers = true)]
    pub batches: Option<u32>,
    /// The method: the best known (accurate, where none is given), or what the founding paper writes.
    #[arg(long, value_parser = mode())]
    pub mode: Option<Mode>,
    /// Survival exponent β from 0 (no roulette) to 1 (the paper's); 0.15 where none is given.
    #[arg(long, value_name = "BETA", allow_hyphen_values = true)]
    pub survival: Option<f64>,
    /// Whether bands share paths; shared where nothing is given.
    #[arg(long, value_parser = spectral())]
    pub spectral: Option<Spectral>,
    /// How long echograms are simulated [s], instead of the scene's duration.
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    pub duration: Option<f64>,
    /// Trace part I of N only, I from 1.
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    pub shard: Option<ShardRange>,
    /// Add emissions to this map of the same scene: N of --sonels instead of what it has, everything else as it was
    /// traced. The result is the map of the longer run, byte for byte; it may replace the old one.
    #[arg(long, value_name = "MAP.sonelmap")]
    pub extend: Option<PathBuf>,
    /// Take the decision about effects from this map of the same scene, mode and duration instead of making it again: for the shards of a
    /// run. A map of one sonel (--sonels 1) will do.
    #[arg(long, value_name = "MAP.sonelmap", conflicts_with_all = ["effects", "extend"])]
    pub decision: Option<PathBuf>,
    /// Print the predicted cost and intervals for several accuracies; with --output, run and compare.
    #[arg(long)]
    pub plan: bool,
    /// Add sonels until the half-width of every 95 % interval at the scene's receivers is below its target. Exit code 1
    /// where that is not reached. Figures: level, g, edt, t20, t30, c50, c80, d50, ts; units: %, s, ms, dB, jnd.
    #[arg(long, value_name = "TARGETS", requires = "output")]
    pub until: Option<Targets>,
    /// Stop --until after this time by the clock: 60s, 5min, 2h.
    #[arg(long, value_name = "TIME", value_parser = parse_time, requires = "until")]
    pub at_most: Option<f64>,
    /// Effects: auto (where nothing is given), all or none, then changes: auto,-air; auto:1 leaves
    /// out what changes less than 1 just-noticeable difference, auto a tenth
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true)]
    pub effects: Option<EffectSpec>,
    /// Print counts, fates and the energy ledger as JSON.
    #[arg(long)]
    pub json: bool,
    /// Say nothing on stderr but errors.
    #[arg(long)]
    pub quiet: bool,
    /// Threads; all cores where none is given. The result does not depend on it.
    #[arg(long, value_name = "N", value_parser = parse_threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

impl Arguments {
    /// The settings of the run.
    ///
    /// # Errors
    /// One sentence per option that is out of range or contradicts the mode.
    pub fn settings(&self) -> anyhow::Result<Settings> {
        let problems = self.problems();
        if !problems.is_empty() {
            bail!("{}", problems.join("\nerror: "));
        }
        let paper = self.mode == Some(Mode::Paper);
        let defaults = Settings::default();
        Ok(Settings {
            emissions: self.sonels.unwrap_or(defaults.emissions),
            seed: self.seed.unwrap_or(defaults.seed),
            batches: self.batches.unwrap_or(defaults.batches),
            survival: self.survival.unwrap_or(if paper { 1.0 } else { defaults.survival }),
            spectral: if paper { Spectral::PerBand } else { self.spectral.unwrap_or(Spectral::Shared) },
            mode: self.mode.unwrap_or(defaults.mode),
            extinction_threshold: defaults.extinction_threshold,
        })
    }

    fn problems(&self) -> Vec<String> {
        let mut problems = Vec::new();
        if let Some(survival) = self.survival
            && !(0.0..=1.0).contains(&survival)
        {
            problems.push(format!("--survival {survival} is outside 0 … 1"));
        }
        if self.mode == Some(Mode::Paper) {
            if self.survival.is_some_and(|survival| survival < 1.0) {
                problems.push(
                    "--mode paper means --survival 1: leave --survival out or use --mode accurate".into(),
                );
            }
            if self.spectral == Some(Spectral::Shared) {
                problems.push(
                    "--mode paper traces every band on its own: leave --spectral out or use --mode accurate"
                        .into(),
                );
            }
        }
        if let Some(duration) = self.duration
            && !(duration > 0.0 && duration <= LONGEST_DURATION)
        {
            problems.push(format!(
                "--duration {duration} is no duration: give seconds above 0 and at most {LONGEST_DURATION}, an hour"
            ));
        }
        if self.extend.is_some() && self.sonels.is_none() && self.until.is_none() {
            problems.push("--extend needs --sonels N: the emissions of the whole new map".into());
        }
        if self.extend.is_some() && self.shard.is_some() {
            problems.push(
                "--extend makes a whole map and --shard a part of one: trace the shards of the longer run, or leave \
                 --shard out"
                    .into(),
            );
        }
        if self.until.is_some() && self.shard.is_some() {
            problems.push(
                "--until looks at the whole run and --shard traces a part of it: find N with --plan, then trace shards"
                    .into(),
            );
        }
        if self.sonels == Some(0) {
            problems.push("--sonels 0 traces nothing: give at least 1".into());
        }
        problems
    }

    /// The part of the run.
    #[must_use]
    pub fn shard_range(&self) -> ShardRange {
        self.shard.unwrap_or(ShardRange::WHOLE)
    }
}
