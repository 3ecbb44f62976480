//! `sonel-analyze parameters`: parameters of every source at every receiver.

mod seats;

use std::io::Write;

use anyhow::bail;
use serde_json::json;

use sonel_analysis::modal::ModalBands;
use sonel_analysis::receiver::parameters_of;
use sonel_analysis::{ReceiverParameters, report};
use sonel_console::follower::Follower;
use sonel_console::progress::ProgressSink;
use sonel_console::{Log, Outcome, spelled};
use sonel_echogram::Response;

use crate::arguments::{Format, Parameters};
use crate::open;

/// Reads the parameters off a response.
///
/// # Errors
/// When the response is unusable or `out` cannot be written.
pub fn run(
    arguments: &Parameters,
    quiet: bool,
    out: &mut dyn Write,
    log: &mut Log<'_>,
) -> anyhow::Result<Outcome> {
    let response = arguments.heard.heard(open::response(&arguments.response)?)?;
    if !arguments.targets.is_empty() && arguments.format == Format::Csv {
        bail!("--target prints no CSV: choose --format table or json");
    }
    let mut parameters = parameters_of(&response, arguments.heard.talk().as_ref());
    let materials = match &arguments.map {
        Some(map) => {
            let follower = Follower::new(ProgressSink::unless(quiet), log);
            let map = sonel::Map::open(map).map_err(spelled)?;
            let (uncertainty, heard) = (&arguments.uncertainty, &arguments.heard);
            Some(uncertainty.attach(&mut parameters, &response, &map, heard, &follower)?)
        }
        None => None,
    };
    let shares = seats::shares(&arguments.targets, &parameters, response.metadata["volume_m3"].as_f64());
    match arguments.format {
        Format::Table if arguments.mean => {
            write!(out, "{}{}", report::means_table(&parameters, &title(&response)), seats::text(&shares))?;
        }
        Format::Csv if arguments.mean => report::means_csv(&parameters, &mut *out)?,
        Format::Json => {
            let mut written = if arguments.mean {
                json!({ "means": report::means_json(&parameters) })
            } else {
                report::json(&parameters)
            };
            if !shares.is_empty() {
                written["targets"] = seats::json(&shares);
            }
            if let Some(materials) = &materials {
                written["material_uncertainty"] = materials.json();
            }
            writeln!(out, "{written:#}")?;
        }
        Format::Table => {
            write!(
                out,
                "{}",
                report::table(&parameters, &title(&response), arguments.heard.noise.is_some())
            )?;
            write!(out, "{}", seats::text(&shares))?;
        }
        Format::Csv => report::csv(&parameters, &mut *out)?,
    }
    if arguments.mean {
        return Ok(Outcome::Done);
    }
    if parameters.len() > response.sources() {
        writeln!(
            log,
            "note: receivers share sonels, so their errors are correlated; each interval holds for one parameter"
        )?;
    }
    if let Some(bands) = modal_bands(&response, &parameters) {
        writeln!(log, "note: {bands}")?;
    }
    let warned = parameters.iter().map(warnings).sum::<usize>();
    if warned > 0 {
        let place = match arguments.format {
            Format::Table => "footnotes",
            Format::Csv => "column \"warning\"",
            Format::Json => "keys \"warning\"",
        };
        writeln!(log, "warning: parameters with a warning: {warned} ({place})")?;
    }
    Ok(Outcome::Done)
}

/// The beginning of the line above every block: the scene, where the response names one.
fn title(response: &Response) -> String {
    let variant = response.metadata["variant"].as_str().map(|variant| format!(", {variant}"));
    let variant = variant.unwrap_or_default();
    response.metadata["scene"].as_str().map(|scene| format!("{scene}{variant}: ")).unwrap_or_default()
}

/// Bands of a response whose room states its volume that lie below the Schroeder frequency.
pub fn modal_bands(response: &Response, parameters: &[ReceiverParameters]) -> Option<ModalBands> {
    ModalBands::of(parameters, response.metadata["volume_m3"].as_f64()?)
}

fn warnings(receiver: &ReceiverParameters) -> usize {
    receiver
        .parameters()
        .filter(|estimate| estimate.as_ref().is_ok_and(|estimate| estimate.warning.is_some()))
        .count()
}
