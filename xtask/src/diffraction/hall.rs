//! What edges do in a real hall: six seats, three of them in the shadow of the source, with edges left out, exact, bending packets
//! and as the founding paper has them.

use std::fmt::Write;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use sonel_analysis::plot::{Axis, Mark, Panel, Point, Series, Sheet};

use crate::workspace;

const FOLDER: &str = "target/diffraction";

/// Where is listened, each name with its position; the last three do not see the source.
const SEATS: [(&str, &str); 6] = [
    ("stalls front", "2.5,13.9,1.5"),
    ("stalls middle", "-7,19.6,2.4"),
    ("under the balcony", "-2,29.1,3.9"),
    ("balcony, second row", "-3,29.4,8.7"),
    ("behind the parapet", "-3,26.6,7.6"),
    ("beside the stage", "-10.2,9.4,1.2"),
];

const SCENE: &str = "scenes/hall/scene.toml";

/// A run: name, effects, further options of tracing and of rendering.
type Run = (&'static str, &'static str, &'static [&'static str], &'static [&'static str]);

const RUNS: [Run; 6] = [
    ("off", "auto,-diffraction,-bending", &["--sonels", "20k"], &[]),
    ("exact", "auto,+diffraction,-bending", &["--sonels", "20k"], &[]),
    ("paper-off", "auto,-diffraction", &["--sonels", "20k", "--mode", "paper"], &["--estimator", "paper"]),
    ("paper", "auto,+diffraction", &["--sonels", "20k", "--mode", "paper"], &["--estimator", "paper"]),
    // Bands that are bent have paths of their own, and other ones than without: noise is that of fewer packets, twice.
    ("straight", "auto,-diffraction,-bending", &["--sonels", "160k"], &[]),
    ("bending", "auto,-diffraction", &["--sonels", "160k"], &[]),
];

/// What is compared with what, and as what.
const COMPARISONS: [(&str, &str, &str); 3] =
    [("exact", "off", "exact"), ("paper", "paper-off", "the paper's"), ("bending", "straight", "bending")];

/// Figures shown: key, label.
const FIGURES: [(&str, &str); 2] = [("level_db", "level [dB]"), ("clarity_c80_db", "C80 [dB]")];
/// Written down, not drawn: [s].
const DECAY: &str = "t30_s";

/// A figure with edges less the same without.
pub struct Change {
    model: &'static str,
    seat: String,
    center_frequency_hz: f64,
    figure: String,
    /// In the figure's unit.
    value: f64,
    /// Of the 95 % interval.
    half_width: f64,
}

/// Traces and renders everything.
pub fn conduct() -> Result<()> {
    std::fs::create_dir_all(workspace::root().join(FOLDER))?;
    let seats: Vec<String> = SEATS.iter().map(|(name, place)| format!("--receiver={name}={place}")).collect();
    let seats: Vec<&str> = seats.iter().map(String::as_str).collect();
    for (name, effects, tracing, rendering) in RUNS {
        let (map, response) = (file(name, "sonelmap"), file(name, "npz"));
        let words = [SCENE, "-o", &map, "--effects", effects, "--quiet"];
        workspace::program("sonel-trace", &[&words[..], tracing].concat())?;
        let words = [&map, "-o", &response, "--quiet"];
        workspace::program("sonel-render", &[&words[..], &seats, rendering].concat())?;
    }
    Ok(())
}

fn file(name: &str, kind: &str) -> String {
    format!("{FOLDER}/{name}.{kind}")
}

/// What the runs say, by model, seat, band and figure.
pub fn changes() -> Result<Vec<Change>> {
    let keys: Vec<&str> = FIGURES.iter().map(|(key, _)| *key).chain([DECAY]).collect();
    let mut changes = Vec::new();
    for (with, without, model) in COMPARISONS {
        let output = workspace::output(
            "sonel-analyze",
            &["diff", &file(without, "npz"), &file(with, "npz"), "--json"],
        )?;
        // 1 says that they differ.
        ensure!(output.status.code().is_some_and(|code| code <= 1), "sonel-analyze diff: {}", output.status);
        let json: Value = serde_json::from_slice(&output.stdout)?;
        let list = json["differences"].as_array().context("no differences")?;
        for entry in list.iter().filter(|entry| keys.iter().any(|key| entry["figure"] == *key)) {
            let number = |value: &Value| value.as_f64().context("a figure is missing");
            let interval = &entry["difference"]["ci95"];
            changes.push(Change {
                model,
                seat: entry["receiver"].as_str().context("no receiver")?.to_owned(),
                center_frequency_hz: number(&entry["center_frequency_hz"])?,
                figure: entry["figure"].as_str().context("no figure")?.to_owned(),
                value: number(&entry["difference"]["value"])?,
                half_width: 0.5 * (number(&interval[1])? - number(&interval[0])?),
            });
        }
    }
    Ok(changes)
}

fn chosen<'a>(
    changes: &'a [Change],
    (model, seat, figure): (&'a str, &'a str, &'a str),
) -> impl Iterator<Item = &'a Change> {
    changes.iter().filter(move |c| c.model == model && c.seat == seat && c.figure == figure)
}

/// A panel a seat, changes of `figure` over bands.
pub fn sheet(changes: &[Change], (figure, label): (&str, &str)) -> Sheet {
    let panel = |&(seat, _): &(&str, &str)| Panel {
        title: seat.to_owned(),
        x: Axis::logarithmic("band [Hz]").with_ticks(vec![63.0, 250.0, 1000.0, 4000.0]),
        y: Axis::linear(label).from_to(-4.0, 10.0),
        series: COMPARISONS
            .iter()
            .map(|&(_, _, model)| {
                let points = chosen(changes, (model, seat, figure))
                    .map(|c| Point::within(c.center_frequency_hz, c.value, c.half_width));
                Series::new(model, Mark::PointsAndLine, points.collect())
            })
            .collect(),
    };
    Sheet {
        title: format!("What edges change of the {label}: above in sight of the source, below in its shadow"),
        rows: SEATS.chunks(3).map(|seats| seats.iter().map(panel).collect()).collect(),
    }
}

/// Both figures drawn, with the files they go to.
pub fn sheets(changes: &[Change]) -> Vec<(&'static str, Sheet)> {
    FIGURES
        .into_iter()
        .zip(["hall-level.svg", "hall-c80.svg"])
        .map(|(f, file)| (file, sheet(changes, f)))
        .collect()
}

/// All changes as CSV.
pub fn csv(changes: &[Change]) -> Result<String> {
    let mut text = "model,seat,center_frequency_hz,figure,difference,half_width\n".to_owned();
    for Change { model, seat, center_frequency_hz, figure, value, half_width } in changes {
        writeln!(text, "{model},\"{seat}\",{center_frequency_hz},{figure},{value:.4},{half_width:.4}")?;
    }
    Ok(text)
}

/// Changes of levels by all models, and of T30 by bending, as tables.
pub fn markdown(changes: &[Change]) -> Result<String> {
    let models = COMPARISONS.map(|(_, _, model)| model);
    let levels = table(changes, FIGURES[0].0, &models)?;
    let decays = table(changes, DECAY, &models[2..])?;
    Ok(format!(
        "Level with edges less level without them [dB], 95 % intervals; the last three seats are in the source's shadow.\n\n{levels}\n\
         T30 with bending less T30 without [s].\n\n{decays}"
    ))
}

fn table(changes: &[Change], figure: &str, models: &[&str]) -> Result<String> {
    let mut text = String::from("| seat | edges |");
    let bands: Vec<f64> =
        chosen(changes, ("exact", SEATS[0].0, FIGURES[0].0)).map(|c| c.center_frequency_hz).collect();
    bands.iter().try_for_each(|band| write!(text, " {band} Hz |"))?;
    writeln!(text, "\n|---|---|{}", "---|".repeat(bands.len()))?;
    for (seat, _) in SEATS {
        for model in models {
            write!(text, "| {seat} | {model} |")?;
            for band in &bands {
                let of_band = |c: &&Change| c.center_frequency_hz.total_cmp(band).is_eq();
                match chosen(changes, (model, seat, figure)).find(of_band) {
                    Some(Change { value, half_width, .. }) => {
                        write!(text, " {value:+.2} ± {half_width:.2} |")?;
                    }
                    // Too noisy to be judged.
                    None => write!(text, " – |")?,
                }
            }
            writeln!(text)?;
        }
    }
    Ok(text)
}
