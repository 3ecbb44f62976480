//! `sonel-analyze sensitivity`: derivatives of parameters by coefficients, ranked.

use std::io::Write;

use anyhow::Context;
use sonel::analysis::{Parameter, sensitivity};
use sonel::rendering::RenderSettings;
use sonel::study::response::receivers_of;
use sonel_console::Outcome;
use sonel_console::progress::Progress;
use sonel_design::sensitivity::{VariedMap, sensitivities};

use crate::arguments::{Format, SensitivityArguments};
use crate::open;

/// Parameters that are told.
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
) -> anyhow::Result<Outcome> {
    let (mut map, geometry) = open::checked_map(&arguments.map)?;
    let scene = map.header().scene.clone();
    let receivers =
        if arguments.receivers.is_empty() { receivers_of(&scene) } else { arguments.receivers.clone() };
    let progress = Progress::begin("rendering", quiet);
    let sources = scene.sources.len() as f64;
    let (geometry, receivers) = (&geometry, &receivers[..]);
    let varied = VariedMap { map: &mut map, geometry, receivers, render: RenderSettings::default() };
    let mut reach = |source: usize, share: f64| progress.reach((source as f64 + share) / sources);
    let found =
        sensitivities(varied, &WANTED, &mut reach).with_context(|| arguments.map.display().to_string())?;
    drop(progress);
    let centers = scene.bands.nominal();
    match arguments.format {
        Format::Table => write!(out, "{}", sensitivity::tables(&found, &WANTED, centers))?,
        Format::Csv => sensitivity::csv(&found, centers, out)?,
        Format::Json => writeln!(out, "{:#}", sensitivity::json(&found, &WANTED, centers))?,
    }
    Ok(Outcome::Done)
}
