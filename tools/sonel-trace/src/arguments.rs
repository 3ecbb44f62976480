//! The command line of `sonel-trace`.

use std::path::PathBuf;

use clap::Parser;
use sonel::study::target;
use sonel::{Effects, Mode, ShardRange, Spectral, Targets, TraceOptions, Variants, parse_count, parse_time};
use sonel_console::choices::{mode, spectral};
use sonel_console::parse_threads;
use sonel_console::shard::parse_shard;

/// Traces packets through a scene and saves the sonel map.
#[derive(Debug, Clone, Parser)]
pub struct Arguments {
    /// The scene file.
    #[arg(value_name = "SCENE.toml")]
    pub scene: PathBuf,
    /// Map to write.
    ///
    /// An existing map is replaced when the new one is complete. Optional with --plan.
    #[arg(short, long, value_name = "MAP.sonelmap", required_unless_present = "plan")]
    pub output: Option<PathBuf>,
    /// Packets per source [default: 16k].
    ///
    /// With --decision the default is the number of that map. With --spectral per-band the number is per band, with --shard of all shards,
    /// with --extend of the whole new map, with --until the maximum.
    #[arg(long, alias = "sonels", value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub packets: Option<u64>,
    /// Seed of every random number [default: 1].
    #[arg(long, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Batches, for intervals [default: 32].
    ///
    /// The spread of 1 … 4096 batches of packets gives the 95 % intervals.
    #[arg(long, value_name = "G", value_parser = clap::value_parser!(u32).range(1..=4096), allow_negative_numbers = true)]
    pub batches: Option<u32>,
    /// Method: accurate or paper [default: accurate].
    ///
    /// Paper mode has one path per band, β = 1 and the diffraction of the founding paper.
    #[arg(long, value_parser = mode())]
    pub mode: Option<Mode>,
    /// Roulette exponent β, 0 … 1 [default: 0.15].
    ///
    /// A packet survives a reflection with probability a^β, where a is the share of its energy that remains. 0 is no Russian
    /// roulette.
    #[arg(long, value_name = "BETA", allow_hyphen_values = true)]
    pub survival: Option<f64>,
    /// Paths shared or per-band [default: shared].
    #[arg(long, value_parser = spectral())]
    pub spectral: Option<Spectral>,
    /// Length of echograms [s] [default: of the scene].
    ///
    /// At most 3600 s. If the scene states none, a run lasts as long as the room decays.
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    pub duration: Option<f64>,
    /// Trace part I of N [default: all].
    ///
    /// I counts from 1. Not with --extend or --until. sonel-analyze merge joins the parts.
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    pub shard: Option<ShardRange>,
    /// Carry further materials; repeatable [default: variants of the scene].
    ///
    /// The map then supports them in --set of sonel-render. VALUES are numbers with commas, such as
    /// materials.NAME.absorption=0.02,0.9, a range 0.02:0.9, or lists per band in brackets. Besides absorption: scattering,
    /// diffuse, transmission, sound_reduction_db. materials.NAME=ENTRY,… takes entries of the library. Not with --mode paper.
    #[arg(long = "for", value_name = "NAME=VALUES", value_parser = str::parse::<Variants>)]
    pub variants: Vec<Variants>,
    /// Continue this map to --packets or --until.
    ///
    /// The map must be of the same scene and no shard. Its settings are kept, and the result is byte for byte the map of the
    /// longer run. --output may name the same file.
    #[arg(long, value_name = "MAP.sonelmap")]
    pub extend: Option<PathBuf>,
    /// Take effects and duration from this map.
    ///
    /// The map must be of the same scene, variants, mode and duration; one packet is enough. Not with --effects or --extend.
    #[arg(long, value_name = "MAP.sonelmap", conflicts_with_all = ["effects", "extend"])]
    pub decision: Option<PathBuf>,
    /// Predict cost and intervals.
    ///
    /// Prints them for several accuracies. With --output, also runs and compares.
    #[arg(long)]
    pub plan: bool,
    /// Target half-widths, such as t30<1%,level<0.1dB.
    #[arg(long, value_name = "TARGETS", requires = "output", long_help = format!(
        "Target half-widths, such as t30<1%,level<0.1dB,c80<0.2jnd\n\n\
         Adds packets until the half-width of every 95 % interval meets its target; else exit code 1. The map is that of --packets with the \
         final number. Parameters: {}; units: %, s, ms, dB, jnd.",
        target::names()
    ))]
    pub until: Option<Targets>,
    /// Time limit, such as 5min or 2h.
    ///
    /// A run that is predicted to take longer on all cores is refused before it starts; --until ends with what it has.
    #[arg(long, value_name = "TIME", value_parser = parse_time, default_value = "10min")]
    pub at_most: f64,
    /// Memory limit [bytes], such as 8G.
    ///
    /// A run that is predicted to take more memory of its own is refused before it starts. Not with --until.
    #[arg(long, value_name = "BYTES", value_parser = parse_count, allow_negative_numbers = true, conflicts_with = "until")]
    pub memory: Option<u64>,
    /// Simulated effects [default: auto].
    ///
    /// SPEC is auto, all or none, then changes: auto,-air. auto:X omits effects that change no parameter by X just-noticeable
    /// differences; auto is auto:0.1. all takes air only with +air where the scene has attenuation = false. Effects:
    /// transmission, refraction, air, directivity; with --mode paper also diffraction.
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true)]
    pub effects: Option<Effects>,
    /// Print the run as JSON.
    ///
    /// Counts, fates, ledger, effects and plans.
    #[arg(long)]
    pub json: bool,
    /// Print only errors.
    #[arg(long)]
    pub quiet: bool,
    /// Log each default on a line.
    #[arg(long, conflicts_with = "quiet")]
    pub verbose: bool,
    // Not flattened: whether there is a trace depends on options of this struct alone.
    /// Threads [default: all cores].
    ///
    /// 1 … 1024. The result does not depend on it.
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
            at_most: Some(self.at_most),
            memory: self.memory.map(|bytes| bytes as f64),
        }
    }
}
