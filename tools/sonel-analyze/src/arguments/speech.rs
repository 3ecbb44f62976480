//! Options of speech: `open-plan`, and levels of `parameters`.

use super::Printed;
use std::path::PathBuf;

use clap::Args;
use sonel::analysis::speech::{NoiseLevels, SpeechPower};

/// `open-plan`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-analyze open-plan office.npz --noise 42,38,35,32,28,24,20 \\
    --receiver desk1 --receiver desk2 --receiver desk3 --receiver desk4
  sonel-analyze open-plan none.npz screens-1.4.npz screens-1.8.npz \\
    --noise NR-35 -o screens.svg")]
pub struct OpenPlan {
    /// Responses, side by side.
    ///
    /// Insertion losses are those of the others re the first.
    #[arg(value_name = "RESPONSE.npz", required = true)]
    pub responses: Vec<PathBuf>,
    /// SVG or PNG to write, by its ending.
    ///
    /// Levels with their regression, and speech transmission index, over distance. An existing file is replaced when the new
    /// one is complete.
    #[arg(short, long, value_name = "X.svg|X.png")]
    pub output: Option<PathBuf>,
    /// Background noise.
    ///
    /// A curve such as NR-35 or NC-30, or levels in the octaves 125 … 8000 Hz [dB re 20 µPa], seven numbers with commas
    /// between.
    #[arg(long, value_name = "CURVE|L125,…,L8000", allow_hyphen_values = true)]
    pub noise: NoiseLevels,
    /// Speech power [default: normal, ISO 3382-3].
    ///
    /// normal, raised, loud, shouted, iec, or power levels in the octaves of --noise [dB re 1 pW].
    #[arg(long, value_name = "EFFORT|LW125,…,LW8000", allow_hyphen_values = true)]
    pub speech: Option<SpeechPower>,
    /// Source [default: the first].
    ///
    /// The talker.
    #[arg(long, value_name = "NAME")]
    pub source: Option<String>,
    /// Workstations; repeatable [default: all].
    ///
    /// Receivers of the line.
    #[arg(long = "receiver", value_name = "NAME")]
    pub receivers: Vec<String>,
    /// Table or JSON.
    #[command(flatten)]
    pub printed: Printed,
}
