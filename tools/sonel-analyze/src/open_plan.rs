//! `sonel-analyze open-plan`: parameters of ISO 3382-3 along a line of receivers.

use std::io::Write;

use anyhow::{Context, bail};
use comfy_table::{CellAlignment, Table, presets};
use serde_json::{Value, json};
use sonel_analysis::ParameterValue;
use sonel_analysis::modulation::Talk;
use sonel_analysis::open_plan::{Line, SPEECH_POWER_LEVEL_DB, line};
use sonel_analysis::report;
use sonel_console::Outcome;
use sonel_echogram::Response;

use crate::arguments::OpenPlan;
use crate::open;

/// Places that the standard asks for.
const WANTED: usize = 4;

/// Reads the parameters of a line of receivers.
///
/// # Errors
/// When the response is unusable or lacks a source or receiver that is named, or `out` cannot be written.
pub fn run(arguments: &OpenPlan, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let response = open::response(&arguments.response)?;
    let find = |what: &str, names: &[String], wanted: &String| {
        names
            .iter()
            .position(|name| name == wanted)
            .with_context(|| format!("the response has no {what} \"{wanted}\"; it has {}", names.join(", ")))
    };
    let source = match &arguments.source {
        Some(name) => find("source", &response.source_names, name)?,
        None => 0,
    };
    let named: Vec<usize> = arguments
        .receivers
        .iter()
        .map(|name| find("receiver", &response.receiver_names, name))
        .collect::<anyhow::Result<_>>()?;
    let receivers = if named.is_empty() { (0..response.receivers()).collect() } else { named };
    check_twice(&receivers, &response)?;
    let power_level_db = Some(arguments.speech.unwrap_or(SPEECH_POWER_LEVEL_DB));
    let found =
        line(&response, source, &receivers, &Talk { power_level_db, noise_level_db: arguments.noise });
    if found.places.len() < WANTED {
        writeln!(log, "warning: {} workstations; ISO 3382-3 requires at least {WANTED}", found.places.len())?;
    }
    if arguments.json {
        writeln!(out, "{:#}", object(&found, &response.source_names[source]))?;
    } else {
        write!(out, "{}", table(&found, &response.source_names[source]))?;
    }
    Ok(Outcome::Done)
}

fn check_twice(receivers: &[usize], response: &Response) -> anyhow::Result<()> {
    let twice = |(at, receiver): (usize, &usize)| receivers[..at].contains(receiver).then_some(*receiver);
    match receivers.iter().enumerate().find_map(twice) {
        Some(receiver) => bail!("receiver \"{}\" is named twice", response.receiver_names[receiver]),
        None => Ok(()),
    }
}

fn numbers(line: &Line) -> [(&'static str, &'static str, &ParameterValue); 4] {
    [
        ("D2,S [dB]", "decay_rate_d2s_db", &line.decay_rate_db),
        ("Lp,A,S,4m [dB]", "speech_level_at_4_m_db", &line.level_at_4_m_db),
        ("rD [m]", "distraction_distance_m", &line.distraction_distance),
        ("rP [m]", "privacy_distance_m", &line.privacy_distance),
    ]
}

fn object(line: &Line, source: &str) -> Value {
    let places: Vec<Value> = line
        .places
        .iter()
        .map(|place| {
            json!({
                "receiver": place.name,
                "distance_m": place.distance,
                "speech_level_db": report::estimate(&place.speech_level_db),
                "speech_transmission_index": report::estimate(&place.speech_transmission_index),
            })
        })
        .collect();
    let mut object = json!({ "source": source, "places": places });
    for (_, key, estimate) in numbers(line) {
        object[key] = report::estimate(estimate);
    }
    object
}

fn table(line: &Line, source: &str) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING);
    table.set_header(["receiver", "r [m]", "Lp,A,S [dB]", "STI"]);
    let mut reasons = Vec::new();
    for place in &line.places {
        let [level, index] = [(&place.speech_level_db, 1), (&place.speech_transmission_index, 3)]
            .map(|(estimate, digits)| cell(estimate, digits, &mut reasons));
        table.add_row([place.name.clone(), format!("{:.2}", place.distance), level, index]);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let lines: String = table.lines().map(|line| format!("{}\n", line.trim_end())).collect();
    let singles: String = numbers(line)
        .into_iter()
        .map(|(symbol, _, estimate)| format!("{symbol}: {}\n", cell(estimate, 2, &mut reasons)))
        .collect();
    reasons.dedup();
    let reasons: String = reasons.into_iter().map(|reason| format!("{reason}\n")).collect();
    format!("line from source \"{source}\"\n{lines}{singles}±: half-width of the 95 % interval\n{reasons}")
}

fn cell(estimate: &ParameterValue, digits: usize, reasons: &mut Vec<String>) -> String {
    let estimate = match estimate {
        Ok(estimate) => estimate,
        Err(reason) => {
            reasons.push(format!("–: {reason}"));
            return "–".to_owned();
        }
    };
    reasons.extend(estimate.warning.clone());
    match &estimate.interval {
        Ok([low, high]) => {
            let half = (high - estimate.value).max(estimate.value - low);
            format!("{:.digits$} ±{half:.digits$}", estimate.value)
        }
        Err(_) => format!("{:.digits$}", estimate.value),
    }
}
