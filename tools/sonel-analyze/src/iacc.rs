//! `sonel-analyze iacc`: interaural cross-correlation of binaural impulse responses.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use serde_json::{Value, json};
use sonel::analysis::report::aligned;
use sonel::sound::Iacc;
use sonel_console::Outcome;

use crate::arguments::IaccArguments;
use crate::open;

/// Why a window has no value.
const NOTHING: &str = "one ear receives no energy in this octave";
/// What stands in the last row of a table.
const MEAN: &str = "500 … 2000";

/// Prints IACC of every recording.
///
/// # Errors
/// When a file is no WAV file of two channels.
pub(crate) fn run(arguments: &IaccArguments, out: &mut dyn Write) -> anyhow::Result<Outcome> {
    let mut read = Vec::new();
    for path in &arguments.recordings {
        let found =
            sonel::sound::iacc(&open::recording(path)?).with_context(|| path.display().to_string())?;
        read.push((path.as_path(), found));
    }
    let all = || read.iter().map(|(path, found)| of_file(path, found)).collect::<Vec<Value>>();
    let text = |(path, found): &(&Path, Iacc)| {
        format!("{}: direct sound at {:.4} s\n{}\n", path.display(), found.onset, table(found))
    };
    arguments.printed.print(out, || json!({ "recordings": all() }), || read.iter().map(text).collect())?;
    Ok(Outcome::Done)
}

fn of_file(path: &Path, found: &Iacc) -> Value {
    let row = |[early, late, all]: [Option<f64>; 3]| json!({ "early": value(early), "late": value(late), "all": value(all) });
    let bands: Vec<Value> = found
        .bands
        .iter()
        .map(|band| {
            let mut row = row([band.early, band.late, band.all]);
            row["center_frequency_hz"] = json!(band.center_frequency_hz);
            row
        })
        .collect();
    json!({ "file": path.display().to_string(), "onset_s": found.onset, "bands": bands, "means": row(found.means()) })
}

fn value(found: Option<f64>) -> Value {
    found.map_or_else(|| json!({ "value": null, "reason": NOTHING }), |value| json!({ "value": value }))
}

fn table(found: &Iacc) -> String {
    let cell = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"));
    let row = |name: String, values: [Option<f64>; 3]| {
        let [early, late, all] = values.map(cell);
        [name, early, late, all]
    };
    let bands = found.bands.iter();
    let bands =
        bands.map(|band| row(band.center_frequency_hz.to_string(), [band.early, band.late, band.all]));
    let rows = bands.chain([row(MEAN.to_owned(), found.means())]);
    aligned(["f [Hz]", "IACC early", "IACC late", "IACC all"], rows, ..)
}
