//! `sonel-analyze report`: responses and their map as one HTML file that opens offline in any browser.
//!
//! The plots are drawn by plotly.js, whose script is part of the file.

mod charts;
mod page;
mod reflections;
mod room;
mod sections;
mod words;

use std::io::Write;
use std::path::PathBuf;

use anyhow::bail;
use serde_json::Value;
use sonel_analysis::{ReceiverParameters, parameters};
use sonel_console::Outcome;
use sonel_console::output::{Kind, Output, has_ending};
use sonel_echogram::Response;

use crate::arguments::Report;
use crate::inspect;
use crate::open::{self, Artifact, WalkedMap};
use page::Page;

/// Pairs of source and receiver with curves of their own: more would make a file of more than 15 MB.
const MOST_PAIRS: usize = 24;

/// A response with its parameters.
struct Subject {
    name: String,
    response: Response,
    parameters: Vec<ReceiverParameters>,
}

/// A map, and what `inspect --json` says of it.
struct Traced {
    walked: Box<WalkedMap>,
    json: Value,
}

/// Writes the report.
///
/// # Errors
/// When a file is unusable, there is no response, more than one map or a map of another scene, or the output cannot be written.
pub fn run(arguments: &Report, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let output = &arguments.output;
    if !has_ending(output, "html") {
        bail!("{} does not end in .html: a report is an HTML file", output.display());
    }
    let target = Output::create(output, Kind::REPORT_PAGE, &arguments.files)?;
    let (subjects, map) = open_all(&arguments.files)?;
    if let Some(Traced { walked, .. }) = &map {
        let named = subjects.iter().map(|subject| (subject.name.as_str(), &subject.response));
        open::check_scene(named, &walked.map.header().scene, log)?;
    }
    let pairs: usize = subjects.iter().map(|subject| subject.parameters.len()).sum();
    if pairs > MOST_PAIRS {
        writeln!(
            log,
            "note: curves of the first {MOST_PAIRS} of {pairs} pairs of source and receiver; tables hold all"
        )?;
    }
    let text = page(&subjects, map.as_ref());
    target.write(|out| out.write_all(text.as_bytes()))?;
    writeln!(log, "{:.1} MB; written to {}", text.len() as f64 / 1e6, output.display())?;
    Ok(Outcome::Done)
}

fn open_all(files: &[PathBuf]) -> anyhow::Result<(Vec<Subject>, Option<Traced>)> {
    let (mut subjects, mut map) = (Vec::new(), None);
    for path in files {
        match open::artifact(path)? {
            Artifact::Response(response) => {
                let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                let parameters = parameters(&response);
                subjects.push(Subject { name, response: *response, parameters });
            }
            Artifact::Map(_) if map.is_some() => {
                bail!("{} is a second map: give the map of the first response alone", path.display())
            }
            Artifact::Map(walked) => map = Some(Traced { json: inspect::map::json(&walked), walked }),
        }
    }
    if subjects.is_empty() {
        bail!("no response among the files: make one from the map with sonel-render");
    }
    Ok((subjects, map))
}

fn page(subjects: &[Subject], map: Option<&Traced>) -> String {
    let scene = subjects[0].response.metadata["scene"].as_str().unwrap_or("Room acoustics");
    let mut page = Page::new(scene);
    sections::summary(&mut page, subjects);
    sections::remarks(&mut page, subjects, map);
    room::section(&mut page, subjects, map);
    sections::curves(&mut page, subjects);
    sections::over_bands(&mut page, subjects);
    sections::over_receivers(&mut page, subjects);
    if let Some(map) = map {
        sections::effects(&mut page, map);
        sections::ledger(&mut page, map);
    }
    sections::provenance(&mut page, subjects);
    page.finish()
}
