//! Options of speech: `open-plan`, and levels of `parameters`.

use std::path::PathBuf;

use clap::Args;
use sonel_analysis::modulation::Talk;

/// Speech and noise for the speech transmission index.
#[derive(Debug, Clone, Args)]
pub struct TalkArguments {
    /// Levels of background noise in the octaves 125 … 8000 Hz [dB re 20 µPa], seven numbers with commas between. The
    /// speech transmission index then includes noise, masking and the reception threshold.
    #[arg(long, value_name = "L125,…,L8000", value_parser = octaves, allow_hyphen_values = true)]
    pub noise: Option<[f64; 7]>,
    /// Power levels of the speech in these octaves [dB re 1 pW] [default: those of the source].
    #[arg(long, value_name = "LW125,…,LW8000", value_parser = octaves, allow_hyphen_values = true, requires = "noise")]
    pub speech: Option<[f64; 7]>,
}

impl TalkArguments {
    /// What is said, where there is a level of noise.
    #[must_use]
    pub fn talk(&self) -> Option<Talk> {
        self.noise.map(|noise_level_db| Talk { power_level_db: self.speech, noise_level_db })
    }
}

/// `open-plan`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:
  sonel-analyze open-plan office.npz --noise 42,38,35,32,28,24,20 \\
    --receiver desk1 --receiver desk2 --receiver desk3 --receiver desk4")]
pub struct OpenPlan {
    /// A response written by sonel-render.
    #[arg(value_name = "RESPONSE.npz")]
    pub response: PathBuf,
    /// Levels of background noise in the octaves 125 … 8000 Hz [dB re 20 µPa], seven numbers with commas between.
    #[arg(long, value_name = "L125,…,L8000", value_parser = octaves, allow_hyphen_values = true)]
    pub noise: [f64; 7],
    /// Power levels of the speech in these octaves [dB re 1 pW] [default: normal effort of ISO 3382-3].
    #[arg(long, value_name = "LW125,…,LW8000", value_parser = octaves, allow_hyphen_values = true)]
    pub speech: Option<[f64; 7]>,
    /// Talker [default: the first source].
    #[arg(long, value_name = "NAME")]
    pub source: Option<String>,
    /// Workstation of the line; repeatable [default: all receivers].
    #[arg(long = "receiver", value_name = "NAME")]
    pub receivers: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Seven levels within what physics allows.
fn octaves(text: &str) -> Result<[f64; 7], String> {
    let wrong = || {
        format!(
            "\"{text}\" is not seven levels: write one for each octave 125 … 8000 Hz: 42,38,35,32,28,24,20"
        )
    };
    let levels: Vec<f64> =
        text.split(',').map(|field| field.trim().parse().map_err(|_| wrong())).collect::<Result<_, _>>()?;
    if let Some(level) = levels.iter().find(|level| !(-100.0..=200.0).contains(*level)) {
        return Err(format!("{level} dB is outside -100 … 200 dB"));
    }
    levels.try_into().map_err(|_| wrong())
}
