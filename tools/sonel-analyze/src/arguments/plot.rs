//! The command line of `plot`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use sonel::analysis::Parameter;
use sonel::study::target;
use sonel_console::heard::HeardArguments;
use sonel_view::Single;

/// `plot`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:
  sonel-analyze plot hall.npz -o hall.svg
  sonel-analyze plot before.npz after.npz --what parameters \\
    --receiver 'stalls rear' -o renovation.png
  sonel-render hall.sonelmap -o grid.npz --grid -10:10:21,2:30:29,1.2
  sonel-analyze plot grid.npz hall.sonelmap --what map --parameter c80 \\
    --band 1000 -o clarity.png
  sonel-analyze plot hall.npz --what early --receiver 'stalls rear' -o early.svg")]
pub struct Plot {
    /// Responses written by sonel-render, drawn side by side, parameters in the same panels. With --what map also the map,
    /// to draw its walls.
    #[arg(value_name = "RESPONSE.npz|MAP.sonelmap", required = true)]
    pub files: Vec<PathBuf>,
    /// File to write, SVG or PNG by its ending; an existing one is replaced when the new one is complete.
    #[arg(short, long, value_name = "X.svg|X.png")]
    pub output: PathBuf,
    /// What to draw: echogram, decay, parameters, early, map [default: echogram, decay and parameters].
    #[arg(long, value_enum, value_delimiter = ',')]
    pub what: Vec<What>,
    /// Source [default: the first].
    #[arg(long, value_name = "NAME")]
    pub source: Option<String>,
    /// Receiver; maps show all [default: the first].
    #[arg(long, value_name = "NAME")]
    pub receiver: Option<String>,
    /// Parameter of a map, named as by `parameters`, or level, g, edt, t20, t30, c50, c80, d50, ts, lf, lfc, lj, sti, and
    /// with --noise u50, snr.
    #[arg(long, value_name = "NAME", default_value = "g", value_parser = parse_drawn)]
    pub parameter: Single,
    /// Band of a map or of early reflections by its nominal centre [Hz]. By default a map shows single numbers, and early
    /// reflections are summed over all bands, weighted by the power of the source.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub band: Option<f64>,
    /// Speech, noise, and sources as one system.
    #[command(flatten)]
    pub heard: HeardArguments,
}

/// `--what`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum What {
    /// Fluence rate over time, per band.
    Echogram,
    /// Schroeder decay curve, per band.
    Decay,
    /// Room-acoustic parameters over bands.
    Parameters,
    /// Strength of the listed arrivals over their delay, by number of reflections.
    Early,
    /// A parameter at all receivers, as a plan in colours.
    Map,
}

/// Short names of parameters that targets of --until do not have: lateral ones, then those of speech in noise.
const SHORT_NAMES: [&str; 5] = ["lf", "lfc", "lj", "u50", "snr"];

fn parse_drawn(text: &str) -> Result<Single, String> {
    let name = text.trim().to_lowercase();
    if name == "sti" || name == "speech_transmission_index" {
        return Ok(Single::Speech);
    }
    let supports = Parameter::SUPPORT.map(|(parameter, _)| parameter);
    let known = [&Parameter::ALL[..], &Parameter::LATERAL, &supports, &Parameter::IN_NOISE].concat();
    let short = Parameter::LATERAL.into_iter().chain(Parameter::IN_NOISE).zip(SHORT_NAMES);
    let named = known.into_iter().map(|parameter| (parameter, parameter.key())).chain(short);
    let found = named.into_iter().find(|(_, known)| *known == name).map(|(parameter, _)| parameter);
    found.or_else(|| target::parameter(&name).ok()).map(Single::Of).ok_or_else(|| {
        let names = target::names();
        format!("\"{text}\" is not a parameter: write one of {names}, lf, lfc, lj, sti, u50, snr")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_of_maps_have_long_and_short_names() {
        for name in ["c80", "C80", "clarity_c80_db"] {
            assert_eq!(parse_drawn(name), Ok(Single::Of(Parameter::ClarityC80)));
        }
        assert_eq!(parse_drawn("lj"), Ok(Single::Of(Parameter::LateLateralLevel)));
        assert_eq!(parse_drawn("support_late_db"), Ok(Single::Of(Parameter::SupportLate)));
        assert_eq!(parse_drawn("sti"), Ok(Single::Speech));
        assert!(parse_drawn("rt60").unwrap_err().contains("t30"));
    }
}
