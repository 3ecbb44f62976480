//! The command line of `sonel-trace`.

use std::path::PathBuf;

use clap::Parser;
use sonel::study::target;
use sonel::{Effects, Mode, ShardRange, Spectral, Targets, TraceOptions, Variants, parse_time};
use sonel_console::choices::{mode, spectral};
use sonel_console::count::parse_count;
use sonel_console::parse_threads;
use sonel_console::shard::parse_shard;

/// Traces packets through a scene and saves the sonel map.
#[derive(Debug, Clone, Parser)]
pub struct Arguments {
    /// The scene file.
    #[arg(value_name = "SCENE.toml")]
    pub scene: PathBuf,
    /// Map to write; an existing one is replaced when the new one is complete. Optional with --plan.
    #[arg(short, long, value_name = "MAP.sonelmap", required_unless_present = "plan")]
    pub output: Option<PathBuf>,
    /// Packets per source (and band with --spectral per-band); with --shard of all shards, with --extend of the whole new
    /// map, with --until the maximum [default: enough for typical half-widths of half a just-noticeable difference, 100k at most; 100k
    /// with --shard or --mode paper; those of --decision].
    #[arg(long, alias = "sonels", value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub packets: Option<u64>,
    /// Seed of every random number [default: 1].
    #[arg(long, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Batches whose spread gives the intervals, 1 … 4096 [default: 32].
    #[arg(long, value_name = "G", value_parser = clap::value_parser!(u32).range(1..=4096), allow_negative_numbers = true)]
    pub batches: Option<u32>,
    /// Method: accurate, or paper: per-band paths, β = 1 and diffraction of the founding paper [default: accurate].
    #[arg(long, value_parser = mode())]
    pub mode: Option<Mode>,
    /// Survival exponent β of the Russian roulette, 0 (no roulette) … 1 [default: 0.15].
    #[arg(long, value_name = "BETA", allow_hyphen_values = true)]
    pub survival: Option<f64>,
    /// Whether bands share their paths: shared or per-band [default: shared].
    #[arg(long, value_parser = spectral())]
    pub spectral: Option<Spectral>,
    /// Length of the echograms [s], at most 3600 [default: of the scene, or as long as the room decays].
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    pub duration: Option<f64>,
    /// Trace only part I of N, I from 1; not with --extend, --until [default: the whole run].
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    pub shard: Option<ShardRange>,
    /// Other materials that the map carries besides, for --set of sonel-render: materials.NAME.absorption=0.02,0.9, a range
    /// 0.02:0.9, lists per band in brackets; also scattering, diffuse, transmission, sound_reduction_db;
    /// materials.NAME=ENTRY,… of the library; repeatable. Not with --mode paper [default: `variants` of the scene].
    #[arg(long = "for", value_name = "NAME=VALUES", value_parser = parse_variants)]
    pub variants: Vec<Variants>,
    /// Continue this map of the same scene to --packets N (larger) or --until, with its own settings: byte for byte the map
    /// of the longer run. --output may name the same file. Not for shards.
    #[arg(long, value_name = "MAP.sonelmap")]
    pub extend: Option<PathBuf>,
    /// Take the choice of effects and the default duration from this map of the same scene, variants, mode and duration; a
    /// map of one packet is enough. Not with --effects, --extend.
    #[arg(long, value_name = "MAP.sonelmap", conflicts_with_all = ["effects", "extend"])]
    pub decision: Option<PathBuf>,
    /// Print predicted cost and intervals for several accuracies; with --output, also run and compare.
    #[arg(long)]
    pub plan: bool,
    /// Targets of half-widths.
    #[arg(long, value_name = "TARGETS", requires = "output", help = format!(
        "Add packets until the half-width of every 95 % interval meets its target, such as t30<1%,level<0.1dB,c80<0.2jnd; else exit code 1. \
         The map is that of --packets with the final number. Parameters: {}; units: %, s, ms, dB, jnd",
        target::names()
    ))]
    pub until: Option<Targets>,
    /// Time limit of --until, such as 60s, 5min, 2h.
    #[arg(long, value_name = "TIME", value_parser = parse_time, requires = "until")]
    pub at_most: Option<f64>,
    /// Own memory that the run may take [bytes], such as 8G: one that is predicted to take more is refused before it starts. Not with
    /// --until.
    #[arg(long, value_name = "BYTES", value_parser = parse_count, allow_negative_numbers = true, conflicts_with = "until")]
    pub memory: Option<u64>,
    /// Simulated effects: auto, all or none, then changes such as auto,-air; auto:1 omits effects below 1 just-noticeable
    /// difference, auto below 0.1 [default: auto].
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true)]
    pub effects: Option<Effects>,
    /// Print counts, fates, ledger, effects and plans as JSON.
    #[arg(long)]
    pub json: bool,
    /// Print only errors on stderr.
    #[arg(long)]
    pub quiet: bool,
    /// Write every default and library entry on a line, instead of all on one.
    #[arg(long, conflicts_with = "quiet")]
    pub verbose: bool,
    // Not flattened: whether there is a trace depends on options of this struct alone.
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
            memory: self.memory.map(|bytes| bytes as f64),
        }
    }
}

/// Reads `materials.NAME.KEY=VALUE,…` or `materials.NAME=ENTRY,…`.
fn parse_variants(text: &str) -> Result<Variants, String> {
    let (name, values) = text.split_once('=').unwrap_or((text, ""));
    Variants::parse(name, values)
}
