//! `sonel-analyze parameters`: parameters of every source at every receiver.

mod seats;
mod side_by_side;

use std::io::Write;
use std::path::Path;

use anyhow::bail;
use serde_json::{Value, json};
use sonel::analysis::modal::ModalBands;
use sonel::analysis::{ReceiverParameters, report};
use sonel::echograms::provenance::{Provenance, SystemSource};
use sonel_console::artifact::stem;
use sonel_console::follower::Follower;
use sonel_console::{Log, Outcome, spelled};
use sonel_view::Subject;

use crate::arguments::{Format, Parameters};
use crate::open;

/// A response that was read, called by its variant or the name of its file.
struct Read {
    subject: Subject,
    title: String,
    shares: Vec<seats::Share>,
    modal: Option<ModalBands>,
}

/// Reads the parameters off one or several responses.
///
/// # Errors
/// When a response is unusable, several have nothing in common, or `out` cannot be written.
pub(crate) fn run(
    arguments: &Parameters,
    quiet: bool,
    out: &mut dyn Write,
    log: &mut Log<'_>,
) -> anyhow::Result<Outcome> {
    if !arguments.targets.is_empty() && arguments.format == Format::Csv {
        bail!("--target prints no CSV: choose --format table or json");
    }
    let map = arguments.map.as_ref().map(sonel::Map::open).transpose().map_err(spelled)?;
    let mut responses: Vec<Read> = Vec::new();
    for path in &arguments.responses {
        let mut read = read(path, arguments, map.as_ref(), quiet, log)?;
        for other_name in [stem(path), path.display().to_string()] {
            if responses.iter().any(|other| other.subject.name == read.subject.name) {
                read.subject.name = other_name;
            }
        }
        responses.push(read);
    }
    match &responses[..] {
        [one] => print(arguments, one, out)?,
        several => side_by_side::print(arguments, several, out)?,
    }
    if !arguments.mean {
        responses.iter().try_for_each(|read| remark(arguments, read, responses.len() > 1, log))?;
    }
    let has_failed = responses.iter().flat_map(|read| &read.shares).any(seats::Share::has_failed);
    Ok(if has_failed { Outcome::Missed } else { Outcome::Done })
}

fn read(
    path: &Path,
    arguments: &Parameters,
    map: Option<&sonel::Map>,
    quiet: bool,
    log: &mut Log<'_>,
) -> anyhow::Result<Read> {
    let heard = &arguments.heard;
    let mut subject = Subject::new(path.display().to_string(), open::response_with_room(path)?, heard)?;
    if let Some(map) = map {
        subject.attach_materials(&arguments.uncertainty, map, heard, &Follower::new(quiet, log))?;
    }
    let provenance = &subject.echograms().provenance;
    let name = provenance.variant.clone().unwrap_or_else(|| stem(path));
    let volume = provenance.volume_m3;
    let title = title(provenance);
    let shares = seats::shares(&arguments.targets, &subject.parameters, provenance);
    let modal = volume.and_then(|volume| ModalBands::of(&subject.parameters, volume));
    subject.name = name;
    Ok(Read { subject, title, shares, modal })
}

fn print(arguments: &Parameters, read: &Read, out: &mut dyn Write) -> anyhow::Result<()> {
    let Read { subject: Subject { parameters, .. }, title, shares, .. } = read;
    match arguments.format {
        Format::Csv if arguments.mean => report::means_csv(parameters, &mut *out)?,
        Format::Json => writeln!(out, "{:#}", json_of(arguments, read))?,
        Format::Table => {
            let table = match arguments.mean {
                true => report::means_table(parameters, title),
                false => report::table(parameters, title, arguments.heard.noise.is_some()),
            };
            write!(out, "{table}{}", seats::text(shares))?;
        }
        Format::Csv => report::csv(parameters, &mut *out)?,
    }
    Ok(())
}

fn json_of(arguments: &Parameters, read: &Read) -> Value {
    let mut written = if arguments.mean {
        json!({ "means": report::means_json(&read.subject.parameters) })
    } else {
        report::json(&read.subject.parameters)
    };
    if let Some(modal) = &read.modal {
        written["spread_over_places"] = modal.json();
    }
    if !read.shares.is_empty() {
        written["targets"] = seats::json(&read.shares);
    }
    if let Some(materials) = &read.subject.materials {
        written["material_uncertainty"] = materials.json();
    }
    written
}

/// What the log has to say of a response, with its name where there are several.
fn remark(arguments: &Parameters, read: &Read, is_named: bool, log: &mut dyn Write) -> anyhow::Result<()> {
    let Read { subject, modal, .. } = read;
    let name = if is_named { format!("{}: ", subject.name) } else { String::new() };
    if subject.parameters.len() > subject.echograms().sources() {
        writeln!(
            log,
            "note: {name}receivers share sonels, so their errors are correlated; each interval holds for one parameter"
        )?;
    }
    if let Some(bands) = modal {
        writeln!(log, "note: {name}{bands}")?;
    }
    let warned = subject.parameters.iter().map(warnings).sum::<usize>();
    if warned > 0 {
        let place = match arguments.format {
            Format::Table => "footnotes",
            Format::Csv if is_named => "print the response alone",
            Format::Csv => "column \"warning\"",
            Format::Json => "keys \"warning\"",
        };
        writeln!(log, "warning: {name}parameters with a warning: {warned} ({place})")?;
    }
    Ok(())
}

/// The beginning of the line above every block: the scene, where the response names one, its variant and the changes of a system's sources.
fn title(provenance: &Provenance) -> String {
    let Some(scene) = &provenance.scene else { return String::new() };
    let variant = provenance.variant.as_ref().map(|variant| format!(", {variant}"));
    format!("{scene}{}{}: ", variant.unwrap_or_default(), system(&provenance.together))
}

/// `, sources "left −3 dB + right 20 ms"`; empty where no source of a system has a gain or delay.
fn system(sources: &[SystemSource]) -> String {
    let of = |SystemSource { source, gain_db, delay_s }: &SystemSource| {
        let changes = [(*gain_db, "dB"), (1e3 * delay_s, "ms")];
        let changes = changes.into_iter().filter(|(change, _)| change.abs() > 0.0);
        let changes: String = changes.map(|(change, unit)| format!(" {change} {unit}")).collect();
        (source.clone(), changes.replace('-', "−"))
    };
    let sources: Vec<(String, String)> = sources.iter().map(of).collect();
    if sources.iter().all(|(_, changes)| changes.is_empty()) {
        return String::new();
    }
    let sources: Vec<String> = sources.iter().map(|(name, changes)| format!("{name}{changes}")).collect();
    format!(", sources \"{}\"", sources.join(" + "))
}

fn warnings(receiver: &ReceiverParameters) -> usize {
    receiver
        .parameters()
        .filter(|estimate| estimate.as_ref().is_ok_and(|estimate| estimate.warning.is_some()))
        .count()
}
