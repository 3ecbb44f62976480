//! `sonel-analyze sensitivity`: derivatives of parameters by coefficients, ranked.

use std::io::Write;

use sonel::analysis::sensitivity;
use sonel::{Coefficient, Map, Parameter, RenderOptions};
use sonel_console::follower::Follower;
use sonel_console::{Log, Outcome, spelled};

use crate::arguments::{Format, SensitivityArguments};

/// Parameters that are printed.
const WANTED: [Parameter; 4] =
    [Parameter::Level, Parameter::EarlyDecayTime, Parameter::T30, Parameter::ClarityC80];

/// Prints derivatives of parameters by absorption and scattering.
///
/// # Errors
/// When the map is unusable, or a receiver is impossible.
pub(crate) fn run(
    arguments: &SensitivityArguments,
    quiet: bool,
    out: &mut dyn Write,
    log: &mut Log<'_>,
) -> anyhow::Result<Outcome> {
    let map = Map::open(&arguments.map).map_err(spelled)?;
    let (both, options) = ([Coefficient::Absorption, Coefficient::Scattering], RenderOptions::default());
    let follower = Follower::new(quiet, log);
    let varied = map.sensitivity(&arguments.receivers, &both, &options, &follower).map_err(spelled)?;
    drop(follower);
    let found = varied.sensitivities(&WANTED);
    let centers = map.sonels().header().scene.bands.nominal();
    match arguments.format {
        Format::Table => write!(out, "{}", sensitivity::tables(&found, &WANTED, centers))?,
        Format::Csv => sensitivity::csv(&found, centers, out)?,
        Format::Json => writeln!(out, "{:#}", sensitivity::json(&found, &WANTED, centers))?,
    }
    Ok(Outcome::Done)
}
