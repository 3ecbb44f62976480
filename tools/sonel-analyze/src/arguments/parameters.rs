//! The command line of `sonel-analyze parameters`.

use std::path::PathBuf;

use clap::Args;
use sonel::study::criteria::Criterion;
use sonel_console::heard::HeardArguments;
use sonel_console::uncertainty::UncertaintyArguments;

use super::Format;

/// `parameters`.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("material_uncertainty", |argument| argument.requires("map")), after_long_help = "Examples:
  sonel-analyze parameters room.npz --format csv > room.csv
  sonel-analyze parameters seats.npz --mean --target 'c80=1dB±3dB@500,1000'
  sonel-analyze parameters class.npz class-tiles.npz
  sonel-analyze parameters room.npz --map room.sonelmap \\
    --material-uncertainty 0.05 --material-uncertainty ceiling=0.1")]
pub struct Parameters {
    /// Responses or measured impulse responses.
    ///
    /// Several are printed side by side with differences from the first.
    #[arg(value_name = "RESPONSE.npz|IMPULSE.wav", required = true)]
    pub responses: Vec<PathBuf>,
    /// Output format.
    #[arg(long, value_enum, default_value_t = Format::Table)]
    pub format: Format,
    /// Print means over the receivers.
    ///
    /// Of each source, with their intervals, and the standard deviation between receivers.
    #[arg(long)]
    pub mean: bool,
    /// Requirement; repeatable.
    ///
    /// Prints the share of receivers within a range, band by band, such as t30=0.6s±20%@250-2000, c50>=2dB, a standard such as din18041-a3, or
    /// FILE.toml:NAME.
    #[arg(long = "target", value_name = "CRITERION", value_parser = str::parse::<Criterion>)]
    pub targets: Vec<Criterion>,
    /// Map of the responses, for --material-uncertainty.
    #[arg(long, value_name = "MAP.sonelmap", requires = "material_uncertainty")]
    pub map: Option<PathBuf>,
    /// Uncertainty of materials.
    #[command(flatten)]
    pub uncertainty: UncertaintyArguments,
    /// Speech, noise, and sources as one system.
    #[command(flatten)]
    pub heard: HeardArguments,
}
