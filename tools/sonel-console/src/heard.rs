//! Options that say what is heard: speech, noise, and sources as one system.

use anyhow::Context;
use clap::Args;
use sonel::analysis::modulation::Talk;
use sonel::analysis::speech::{NoiseLevels, SpeechPower};
use sonel::echograms::{Echograms, SourceChange};

use crate::spelled;

/// Speech, noise, and sources as one system.
#[derive(Debug, Clone, Default, Args)]
pub struct HeardArguments {
    /// Background noise.
    ///
    /// A curve such as NR-35 or NC-30, or levels in the octaves 125 … 8000 Hz [dB re 20 µPa], seven numbers with commas
    /// between. Adds U50 and signal-to-noise ratio; the speech transmission index then includes noise, masking and the
    /// reception threshold.
    #[arg(long, value_name = "CURVE|L125,…,L8000", allow_hyphen_values = true)]
    pub noise: Option<NoiseLevels>,
    /// Speech power [default: of the source].
    ///
    /// normal, raised, loud, shouted, iec, or power levels in the octaves of --noise [dB re 1 pW].
    #[arg(long, value_name = "EFFORT|LW125,…,LW8000", allow_hyphen_values = true, requires = "noise")]
    pub speech: Option<SpeechPower>,
    /// All sources as one system.
    ///
    /// Energies are added; time zero is the first direct sound. Lateral parameters are left out.
    #[arg(long)]
    pub together: bool,
    /// Gain of a source with --together; repeatable [default: of the scene].
    ///
    /// -100 … 100 dB.
    #[arg(long, value_name = "SOURCE=dB", value_parser = number, allow_hyphen_values = true, requires = "together")]
    pub gain: Vec<(String, f64)>,
    /// Delay of a source with --together; repeatable [default: of the scene].
    ///
    /// 0 … 1000 ms.
    #[arg(long, value_name = "SOURCE=ms", value_parser = number, allow_hyphen_values = true, requires = "together")]
    pub delay: Vec<(String, f64)>,
}

impl HeardArguments {
    /// What is said, where there is a level of noise.
    #[must_use]
    pub fn talk(&self) -> Option<Talk> {
        Some(Talk { power_level_db: self.speech.map(|speech| speech.0), noise_level_db: self.noise?.0 })
    }

    /// The words of a command line that say the same.
    #[must_use]
    pub fn words(&self) -> Vec<String> {
        let levels = |levels: [f64; 7]| levels.map(|level| level.to_string()).join(",");
        let mut words = Vec::new();
        words.extend(self.noise.map(|noise| format!("--noise={}", levels(noise.0))));
        words.extend(self.speech.map(|speech| format!("--speech={}", levels(speech.0))));
        words.extend(self.together.then(|| "--together".to_owned()));
        words.extend(self.gain.iter().map(|(name, gain)| format!("--gain={name}={gain}")));
        words.extend(self.delay.iter().map(|(name, delay)| format!("--delay={name}={delay}")));
        words
    }

    /// The response, with its sources as one system where that is asked for.
    ///
    /// # Errors
    /// When a gain or delay is of no source, given twice or impossible.
    pub fn heard(&self, response: Echograms) -> anyhow::Result<Echograms> {
        Ok(self.changes(&response)?.map(|changes| response.together(&changes)).unwrap_or(response))
    }

    /// What becomes of each source within the system, by the scene where no option says otherwise; none where sources stand for themselves.
    ///
    /// # Errors
    /// When a gain or delay is of no source, given twice or impossible, in an option or in the response.
    pub fn changes(&self, response: &Echograms) -> anyhow::Result<Option<Vec<SourceChange>>> {
        let system = || sonel::system(response, &self.gain, &self.delay).map_err(spelled);
        self.together.then(system).transpose()
    }
}

fn number(text: &str) -> anyhow::Result<(String, f64)> {
    let parts = text
        .rsplit_once('=')
        .and_then(|(name, value)| Some((name.trim(), value.trim().parse::<f64>().ok()?)));
    let parts = parts.filter(|(name, value)| !name.is_empty() && (-200.0..=2000.0).contains(value));
    parts.map(|(name, value)| (name.to_owned(), value)).with_context(|| {
        format!("\"{text}\" is not a source with a number: write SOURCE=NUMBER, such as left=-3")
    })
}
