//! The command line of `plot`.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, ValueEnum};
use sonel::analysis::Parameter;
use sonel::analysis::single::Single;
use sonel_console::heard::HeardArguments;

/// `plot`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-analyze plot hall.npz -o hall.svg
  sonel-analyze plot before.npz after.npz --what parameters \\
    --receiver 'stalls rear' -o renovation.png
  sonel-render hall.sonelmap -o grid.npz --grid -10:10:21,2:30:29,1.2
  sonel-analyze plot grid.npz hall.sonelmap --what map --parameter c80 \\
    --band 1000 -o clarity.png
  sonel-analyze plot hall.npz --what early --receiver 'stalls rear' -o early.svg")]
pub struct Plot {
    /// Responses, drawn side by side.
    ///
    /// Parameters are in the same panels. With --what map also the map, to draw its walls.
    #[arg(value_name = "RESPONSE.npz|MAP.sonelmap", required = true)]
    pub files: Vec<PathBuf>,
    /// SVG or PNG to write, by its ending.
    ///
    /// An existing file is replaced when the new one is complete. A PNG is 2000 pixels wide.
    #[arg(short, long, value_name = "X.svg|X.png")]
    pub output: PathBuf,
    /// Drawings, with commas between [default: echogram,decay,parameters].
    ///
    /// map is a plan at the height of the highest receiver, or a section if they differ least along another axis; grey: no
    /// value. Walls are drawn if the map is among the files. early has the listed arrivals by number of reflections, their part
    /// of G over the delay to direct sound.
    #[arg(long, value_enum, value_delimiter = ',')]
    pub what: Vec<What>,
    /// Source [default: the first].
    #[arg(long, value_name = "NAME")]
    pub source: Option<String>,
    /// Receiver; maps show all [default: the first].
    #[arg(long, value_name = "NAME")]
    pub receiver: Option<String>,
    /// Parameter of a map.
    #[arg(long, value_name = "NAME", default_value = "g", value_parser = parse_drawn,
        long_help = format!("Parameter of a map\n\nNamed as by `parameters`, or {}; u50 and snr with --noise.", drawn_names()))]
    pub parameter: Single,
    /// Band of a map or of early reflections.
    ///
    /// Its nominal centre [Hz]. By default a map shows single numbers, and early reflections are summed over all bands,
    /// weighted by the power of the source.
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

fn parse_drawn(text: &str) -> anyhow::Result<Single> {
    // Of a system alone, which has no plan.
    let found =
        Single::named(text.trim()).filter(|&found| found != Single::Of(Parameter::DirectToReverberant));
    found.with_context(|| format!("\"{text}\" is not a parameter: write one of {}", drawn_names()))
}

/// Names of parameters, as help and messages list them.
fn drawn_names() -> String {
    let names = Parameter::ALL.into_iter().chain(Parameter::LATERAL).chain(Parameter::IN_NOISE);
    names
        .map(Parameter::short_name)
        .chain(Single::OF_SEVERAL.map(Single::short_name))
        .collect::<Vec<_>>()
        .join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_of_maps_have_long_and_short_names() {
        for name in ["c80", "C80", "clarity_c80_db"] {
            assert_eq!(parse_drawn(name).unwrap(), Single::Of(Parameter::ClarityC80));
        }
        assert_eq!(parse_drawn("lj").unwrap(), Single::Of(Parameter::LateLateralLevel));
        assert_eq!(parse_drawn("support_late_db").unwrap(), Single::Of(Parameter::SupportLate));
        assert_eq!(parse_drawn("sti").unwrap(), Single::Speech);
        assert!(parse_drawn("drr").unwrap_err().to_string().contains("t30"));
    }
}
