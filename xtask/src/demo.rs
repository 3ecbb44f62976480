//! A room from scene file to parameters, with the programs a user would call.

use std::fmt::Write;
use std::fs;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use xtask::workspace::{self, Profile};

const FOLDER: &str = "target/demo";
/// Columns of the tables: key in the report of `sonel-render`, heading.
const COLUMNS: [(&str, &str); 4] = [
    ("level_db", "level [dB]"),
    ("early_decay_time_s", "EDT [s]"),
    ("t30_s", "T30 [s]"),
    ("clarity_c80_db", "C80 [dB]"),
];

/// Builds the two programs that it needs, as users have them; traces and renders the hall or, if `is_paper`, the room of the founding
/// paper; prints its parameters.
pub(crate) fn run(is_paper: bool) -> Result<()> {
    let name = if is_paper { "seed-room" } else { "hall" };
    let [scene, map, response] = [
        format!("scenes/{name}/scene.toml"),
        format!("{FOLDER}/{name}.sonelmap"),
        format!("{FOLDER}/{name}.npz"),
    ];
    fs::create_dir_all(workspace::root().join(FOLDER)).with_context(|| format!("cannot create {FOLDER}"))?;
    // Not quiet: the first build takes a minute or two, and cargo shows how far it is. By their names alone, so that crates have the features
    // that they have in `cargo build --release`, which then compiles none of them again.
    let mut build =
        workspace::cargo(&["build", "--release", "--bin", "sonel-trace", "--bin", "sonel-render"]);
    let status = build.status().with_context(|| format!("cannot run {build:?}"))?;
    ensure!(status.success(), "{build:?}: {status}");
    let programs = workspace::folder(Profile::Release)?;
    workspace::run_in(&programs, "sonel-trace", &[&scene, "-o", &map])?;
    let json =
        workspace::run_in(&programs, "sonel-render", &[&map, "-o", &response, "--parameters", "--json"])?;
    let report: Value = serde_json::from_str(&json).context("sonel-render printed no JSON")?;
    let receivers =
        report["parameters"]["receivers"].as_array().context("the parameters name no receivers")?;
    print!("\n{}\n{}", bands(receivers)?, seats(receivers));
    println!(
        "\nThe true value of the model lies within the ± with a probability of 95 %; four times the packets (--packets) halve it.\n\
         Look at the room in the browser, or on a page of its own:\n  \
         cargo run --release --bin sonel-view -- {scene}\n  \
         cargo run --release --bin sonel-view -- {map} {response} -o {FOLDER}/{name}.html\n\
         About the room: scenes/{name}/README.md. The response {response} opens with numpy.load."
    );
    Ok(())
}

/// The first receiver in all bands.
fn bands(receivers: &[Value]) -> Result<String> {
    let receiver = receivers.first().context("the scene has no receivers")?;
    let mut text = format!("{}\n{:>9}", title(receiver), "band [Hz]");
    for (_, heading) in COLUMNS {
        write!(text, " {heading:>14}")?;
    }
    text.push('\n');
    for band in receiver["bands"].as_array().context("a receiver has no bands")? {
        write!(text, "{:>9}", band["center_frequency_hz"].as_f64().unwrap_or(f64::NAN))?;
        for (key, _) in COLUMNS {
            write!(text, " {:>14}", figure(&band[key]))?;
        }
        text.push('\n');
    }
    Ok(text)
}

/// Single numbers of every receiver: means over the octaves 500 and 1000 Hz, and the speech transmission index.
fn seats(receivers: &[Value]) -> String {
    let mut text = format!("{:<18}", "500 and 1000 Hz");
    for (_, heading) in COLUMNS {
        let _ = write!(text, " {heading:>14}");
    }
    let _ = writeln!(text, " {:>14}", "STI");
    for receiver in receivers {
        let _ = write!(text, "{:<18}", receiver["name"].as_str().unwrap_or_default());
        for (key, _) in COLUMNS {
            let _ = write!(text, " {:>14}", figure(&receiver["single_numbers"][key]));
        }
        let _ = writeln!(text, " {:>14}", figure(&receiver["speech_transmission_index"]));
    }
    text
}

fn title(receiver: &Value) -> String {
    let name = |key: &str| receiver[key].as_str().unwrap_or_default().to_owned();
    format!("source \"{}\" at receiver \"{}\"", name("source"), name("name"))
}

/// `value ± half-width`, or a dash where the response cannot support the parameter.
fn figure(figure: &Value) -> String {
    let Some(value) = figure["value"].as_f64() else { return "–".into() };
    match (figure["ci95"][0].as_f64(), figure["ci95"][1].as_f64()) {
        (Some(low), Some(high)) => {
            let half = (high - low) / 2.0;
            let digits = if half < 0.01 { 3 } else { 2 };
            format!("{value:.digits$} ± {half:.digits$}")
        }
        _ => format!("{value:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_show_intervals_and_what_is_missing() {
        let receivers = [serde_json::json!({"source": "stage", "name": "seat", "bands": [{
            "center_frequency_hz": 125,
            "level_db": {"value": 58.52, "ci95": [58.42, 58.62]},
            "early_decay_time_s": {"value": 7.5, "ci95": null},
            "t30_s": {"value": null, "reason": "too short"},
            "clarity_c80_db": {"value": -1.5, "ci95": [-1.6, -1.4]},
        }], "single_numbers": {"t30_s": {"value": 2.0, "ci95": [1.9, 2.1]}},
            "speech_transmission_index": {"value": 0.5, "ci95": [0.497, 0.503]}})];
        let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        let text = bands(&receivers).unwrap();
        assert_eq!(words(text.lines().nth(2).unwrap()), "125 58.52 ± 0.10 7.50 – -1.50 ± 0.10");
        assert_eq!(words(seats(&receivers).lines().nth(1).unwrap()), "seat – – 2.00 ± 0.10 – 0.500 ± 0.003");
    }
}
