//! The paper's room from scene file to reverberation times, with the programs a user would call.

use std::fmt::Write;
use std::fs;

use anyhow::{Context, Result};
use serde_json::Value;

use xtask::workspace::{self, Profile};

const SCENE: &str = "scenes/seed-room/scene.toml";
const FOLDER: &str = "target/demo";
const MAP: &str = "target/demo/seed-room.sonelmap";
const RESPONSE: &str = "target/demo/seed-room.npz";

/// Columns of the table: key in the output of `sonel-analyze parameters`, heading.
const COLUMNS: [(&str, &str); 4] = [
    ("level_db", "level [dB]"),
    ("early_decay_time_s", "EDT [s]"),
    ("t20_s", "T20 [s]"),
    ("t30_s", "T30 [s]"),
];

/// Builds the programs, runs the three stages, prints the table.
pub fn run() -> Result<()> {
    fs::create_dir_all(workspace::root().join(FOLDER)).with_context(|| format!("cannot create {FOLDER}"))?;
    workspace::program(Profile::Dev, "sonel-trace", &[SCENE, "-o", MAP])?;
    workspace::program(Profile::Dev, "sonel-render", &[MAP, "-o", RESPONSE])?;
    let json =
        workspace::program(Profile::Dev, "sonel-analyze", &["parameters", RESPONSE, "--format", "json"])?;
    let parameters = serde_json::from_str(&json).context("sonel-analyze parameters printed no JSON")?;
    print!("\n{}", table(&parameters)?);
    println!("\n±: half-width of the 95 % interval. What to expect: scenes/seed-room/README.md");
    println!("The map is {MAP}, the response {RESPONSE} (opens with numpy.load).");
    Ok(())
}

/// One line per receiver and band.
fn table(parameters: &Value) -> Result<String> {
    let mut text = format!("{:<12} {:>9}", "receiver", "band [Hz]");
    for (_, heading) in COLUMNS {
        write!(text, " {heading:>16}")?;
    }
    text.push('\n');
    for receiver in parameters["receivers"].as_array().context("the parameters name no receivers")? {
        let name = receiver["name"].as_str().unwrap_or_default();
        for band in receiver["bands"].as_array().context("a receiver has no bands")? {
            write!(text, "{name:<12} {:>9}", band["center_frequency_hz"].to_string())?;
            for (key, _) in COLUMNS {
                write!(text, " {:>16}", figure(&band[key]))?;
            }
            text.push('\n');
        }
    }
    Ok(text)
}

/// `value ± half-width`, or a dash where the response cannot support the figure.
fn figure(figure: &Value) -> String {
    let Some(value) = figure["value"].as_f64() else { return "–".into() };
    match (figure["ci95"][0].as_f64(), figure["ci95"][1].as_f64()) {
        (Some(low), Some(high)) => format!("{value:.2} ± {:.2}", (high - low) / 2.0),
        _ => format!("{value:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_shows_intervals_and_says_what_is_missing() {
        let parameters = serde_json::json!({"receivers": [{"name": "seat", "bands": [{
            "center_frequency_hz": 125,
            "level_db": {"value": 58.52, "ci95": [58.42, 58.62]},
            "early_decay_time_s": {"value": 7.5, "ci95": null},
            "t20_s": {"value": null, "reason": "too short"},
            "t30_s": {"value": 7.75, "ci95": [7.65, 7.85]},
        }]}]});
        let text = table(&parameters).unwrap();
        let row: Vec<_> = text.lines().nth(1).unwrap().split_whitespace().collect();
        assert_eq!(row.join(" "), "seat 125 58.52 ± 0.10 7.50 – 7.75 ± 0.10");
    }
}
