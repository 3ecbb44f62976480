//! The command line of `sonel-trace`.

use std::path::PathBuf;

use clap::{Args, Parser};
use sonel::{Effects, Mode, ShardRange, Spectral, Targets, TraceOptions, Variants};
use sonel_console::choices::{mode, spectral};
use sonel_console::count::parse_count;
use sonel_console::parse_threads;
use sonel_console::shard::parse_shard;
use sonel_console::time::parse_time;

/// Traces packets through a scene and saves the sonel map.
#[derive(Debug, Clone, Parser)]
pub struct Arguments {
    /// The scene file.
    #[arg(value_name = "SCENE.toml")]
    pub scene: PathBuf,
    /// Map to write; an existing one is replaced when the new one is complete.
    #[arg(short, long, value_name = "MAP.sonelmap", required_unless_present = "plan")]
    pub output: Option<PathBuf>,
    /// Emissions per source (per source and band with --spectral per-band); with --shard of all shards, with --extend of
    /// the whole new map, with --until the maximum [default: 100k; --plan shows what accuracies take].
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub packets: Option<u64>,
    /// Seed of every random number [default: 1].
    #[arg(long, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Batches whose spread gives the intervals [default: 32].
    #[arg(long, value_name = "G", value_parser = clap::value_parser!(u32).range(1..=4096), allow_negative_numbers = true)]
    pub batches: Option<u32>,
    /// Method: accurate (default), or paper: that of the founding paper.
    #[arg(long, value_parser = mode())]
    pub mode: Option<Mode>,
    /// Survival exponent β, 0 (no roulette) to 1 (paper) [default: 0.15].
    #[arg(long, value_name = "BETA", allow_hyphen_values = true)]
    pub survival: Option<f64>,
    /// Whether bands share paths [default: shared].
    #[arg(long, value_parser = spectral())]
    pub spectral: Option<Spectral>,
    /// Length of the echograms [s]; by default that of the scene.
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    pub duration: Option<f64>,
    /// Trace only part I of N, I from 1.
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    pub shard: Option<ShardRange>,
    /// Trace so that the map carries these materials besides, for sonel-render --set: materials.NAME.absorption=0.02,0.9 (values,
    /// a range 0.02:0.9, or [0.1,0.2,…] per band; also scattering, diffuse, transmission, sound_reduction_db), or
    /// materials.NAME=ENTRY,… of the library; repeatable. As `variants` in the scene file.
    #[arg(long = "for", value_name = "NAME=VALUES", value_parser = parse_variants)]
    pub variants: Vec<Variants>,
    /// Continue this map of the same scene to N emissions (--packets) with its own settings. The result is the map of the
    /// longer run, byte for byte; --output may name the same file.
    #[arg(long, value_name = "MAP.sonelmap")]
    pub extend: Option<PathBuf>,
    /// Use the decision about effects stored in this map of the same scene, mode and duration, for the shards of a run. A
    /// map of one packet (--packets 1) suffices.
    #[arg(long, value_name = "MAP.sonelmap", conflicts_with_all = ["effects", "extend"])]
    pub decision: Option<PathBuf>,
    /// Print the predicted cost and intervals for several accuracies; with --output, run and compare.
    #[arg(long)]
    pub plan: bool,
    /// Add packets until the half-width of every 95 % interval at the scene's receivers, without any at a point in mid-room, is
    /// below its target. Exit code 1 if a target is not reached. Parameters: level, g, edt, t20, t30, c50, c80, d50, ts; units: %, s, ms, dB, jnd.
    #[arg(long, value_name = "TARGETS", requires = "output")]
    pub until: Option<Targets>,
    /// Time limit of --until: 60s, 5min, 2h.
    #[arg(long, value_name = "TIME", value_parser = parse_time, requires = "until")]
    pub at_most: Option<f64>,
    /// Effects: auto (default), all or none, then changes: auto,-air; auto:1 omits effects below 1 just-noticeable
    /// difference, auto below 0.1
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true)]
    pub effects: Option<Effects>,
    /// Print counts, fates and the energy ledger as JSON.
    #[arg(long)]
    pub json: bool,
    /// Print only errors on stderr.
    #[arg(long)]
    pub quiet: bool,
    /// Threads; by default all cores. The result does not depend on it.
    #[arg(long, value_name = "N", value_parser = parse_threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

/// Options of the commands beside the trace, as of the trace.
#[derive(Debug, Clone, Args)]
pub(crate) struct Common {
    /// Print only errors on stderr.
    #[arg(long)]
    pub quiet: bool,
    /// Threads; by default all cores. The result does not depend on it.
    #[arg(long, value_name = "N", value_parser = parse_threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

impl Arguments {
    /// The options of the run, but for the maps that they name.
    pub(crate) fn options(&self) -> TraceOptions<'static> {
        TraceOptions {
            packets: self.packets,
            seed: self.seed,
            batches: self.batches,
            survival: self.survival,
            mode: self.mode,
            spectral: self.spectral,
            duration: self.duration,
            shard: self.shard,
            variants: self.variants.clone(),
            extend: None,
            decision: None,
            effects: self.effects.clone(),
            until: self.until.clone(),
            at_most: self.at_most,
        }
    }
}

/// Reads `materials.NAME.KEY=VALUE,…` or `materials.NAME=ENTRY,…`.
fn parse_variants(text: &str) -> Result<Variants, String> {
    let (name, values) = text.split_once('=').unwrap_or((text, ""));
    Variants::parse(name, values)
}
