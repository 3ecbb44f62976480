//! The command line of `sonel-analyze`.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

/// Inspects maps and responses, reads room-acoustic parameters.
#[derive(Debug, Clone, Parser)]
#[command(
    version,
    after_help = "Example:\n  sonel-trace scenes/seed-room/scene.toml -o room.sonelmap\n  \
                  sonel-render room.sonelmap -o room.npz\n  sonel-analyze parameters room.npz\n  \
                  sonel-analyze verify room.sonelmap"
)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Say nothing on stderr but errors.
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Threads; all cores where none is given. The result does not depend on it.
    #[arg(long, value_name = "N", global = true)]
    pub threads: Option<usize>,
}

/// The subcommands.
#[derive(Debug, Clone, Subcommand)]
pub enum Command {
    /// Room-acoustic parameters of ISO 3382-1 with intervals, and the speech transmission index.
    Parameters(Parameters),
    /// What a map or a response is: provenance, counts, ledger, hits and deposits.
    Inspect(Inspect),
    /// Whether a map is whole and sound: checksums, structure, ledger recomputed from the paths.
    Verify(Verify),
    /// Which figures of two responses differ beyond noise; exit code 1 where any does.
    Diff(Diff),
}

/// `diff`.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Example:\n  sonel-analyze diff before.npz after.npz || echo audible or not, it is different"
)]
pub struct Diff {
    /// A response written by sonel-render.
    #[arg(value_name = "A.npz")]
    pub a: PathBuf,
    /// Another, with the same names of sources and receivers.
    #[arg(value_name = "B.npz")]
    pub b: PathBuf,
    /// Print JSON, with every figure compared.
    #[arg(long)]
    pub json: bool,
}

/// `inspect`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:
  sonel-analyze inspect room.sonelmap --json | jq .ledger")]
pub struct Inspect {
    /// A map or a response; which one, its first bytes tell.
    #[arg(value_name = "MAP.sonelmap|RESPONSE.npz")]
    pub file: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// `verify`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:
  sonel-analyze verify room.sonelmap && echo sound")]
pub struct Verify {
    /// A map written by sonel-trace.
    #[arg(value_name = "MAP.sonelmap")]
    pub map: PathBuf,
}

/// `parameters`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:\n  sonel-analyze parameters room.npz --format csv > room.csv")]
pub struct Parameters {
    /// A response written by sonel-render.
    #[arg(value_name = "RESPONSE.npz")]
    pub response: PathBuf,
    /// How to print them.
    #[arg(long, value_enum, default_value_t = Format::Table)]
    pub format: Format,
}

/// `--format`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Aligned columns for people.
    Table,
    /// A row per figure.
    Csv,
    /// An object per receiver.
    Json,
}
