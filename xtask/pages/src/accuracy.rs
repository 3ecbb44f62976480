//! The sweeps behind docs/accuracy.md: what accuracy costs in the shipped scenes, by estimator, by β, and by receivers.
//!
//! Everything goes to target/accuracy. Plots that the page links are copied to docs/accuracy; costs of all sweeps go
//! to the table of the page.

use std::fmt::Write;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use sonel_drawing::plot::{self, Axis, Mark, Panel, Point, Series, Sheet};

use xtask::workspace::{self, Profile};

const FOLDER: &str = "target/accuracy";
const PAGE: &str = "docs/accuracy.md";
const BLOCK: &str = "costs";
const COPIES: &str = "docs/accuracy";
/// File of a sweep that the page shows or links.
const KEPT: &str = "deviation.svg";

const ESTIMATORS: [&str; 4] = ["--estimator", "auto,connection,gather,sphere", "--mode", "accurate,paper"];
const SURVIVALS: [&str; 2] = ["--survival", "0.15,0,0.05,0.4,1"];

/// Scenes with the packets and repeats that take a few minutes each.
const SCENES: [(&str, &str, &str); 3] =
    [("shoebox", "1k,4k,16k,64k", "12"), ("seed-room", "1k,4k,16k", "10"), ("hall", "8k,32k", "5")];

/// Grids of 1, 10, 100 and 1000 receivers in each scene, and the packets they are rendered from.
const GRIDS: [(&str, &str, [&str; 4]); 3] = [
    ("shoebox", "4k", ["7,5,1.2", "1:9:5,1:6:2,1.2", "1:9:10,1:6:10,1.2", "1:9:10,1:6:10,0.5:2.5:10"]),
    ("seed-room", "1k", ["60,9,60", "38:66:5,9,4:66:2", "38:66:10,9,4:66:10", "38:66:10,2:28:10,4:66:10"]),
    ("hall", "1k", ["0,20,4", "-5:5:5,15:20:2,4", "-5:5:10,12:22:10,4", "-5:5:10,12:22:10,4:7:10"]),
];

/// Runs all sweeps, about twenty minutes on a quiet machine, unless older runs are to be drawn again; then writes what the page
/// shows.
pub(crate) fn run(redraw: bool) -> Result<()> {
    std::fs::create_dir_all(workspace::root().join(FOLDER))?;
    let mut rows = String::new();
    for (what, varied) in [("estimators", &ESTIMATORS[..]), ("survival", &SURVIVALS)] {
        let mut sweeps = Vec::new();
        for (scene, packets, repeats) in SCENES {
            if !redraw {
                sweep(scene, what, varied, packets, repeats)?;
            }
            let name = format!("{scene}-{what}");
            keep(&name)?;
            sweeps.push(serde_json::from_str(&workspace::read(&format!("{FOLDER}/{name}/tradeoff.json"))?)?);
        }
        rows += &costs(&sweeps)?;
    }
    let scenes = SCENES.map(|(scene, ..)| scene).join(" | ");
    let table = format!("| setting | {scenes} |\n|---|{}\n{rows}", "---|".repeat(SCENES.len()));
    workspace::write(PAGE, workspace::with_block(&workspace::read(PAGE)?, BLOCK, &table)?)?;
    for (scene, packets, grids) in GRIDS {
        if !redraw {
            render(scene, packets, grids)?;
        }
    }
    draw_receivers()
}

fn sweep(scene: &str, what: &str, varied: &[&str], packets: &str, repeats: &str) -> Result<()> {
    let (file, name) = (format!("scenes/{scene}/scene.toml"), format!("{scene}-{what}"));
    let folder = format!("{FOLDER}/{name}");
    let options =
        ["--packets", packets, "--repeats", repeats, "--effects", "auto,-diffraction", "--threads", "1"];
    let words = ["tradeoff", &file, "-o", &folder];
    workspace::program(Profile::Release, "sonel-analyze", &[&words[..], varied, &options].concat()).map(drop)
}

/// Copies what the page shows of the sweep called `name`.
fn keep(name: &str) -> Result<()> {
    let text = workspace::read(&format!("{FOLDER}/{name}/{KEPT}"))?;
    workspace::write(&format!("{COPIES}/{name}/{KEPT}"), text)
}

/// A table row per setting, a column per sweep: CPU seconds to a twentieth of a JND, or the bias that rules the setting out.
fn costs(sweeps: &[Value]) -> Result<String> {
    let settings = |sweep: &Value| sweep["settings"].as_array().cloned().context("the sweep has no settings");
    let columns: Vec<Vec<Value>> = sweeps.iter().map(settings).collect::<Result<_>>()?;
    let mut rows = String::new();
    for (row, setting) in columns.first().context("no sweeps")?.iter().enumerate() {
        write!(rows, "| {} |", setting["name"].as_str().context("a setting has no name")?)?;
        for column in &columns {
            let other = column.get(row).unwrap_or(&Value::Null);
            ensure!(other["name"] == setting["name"], "the sweeps have different settings: run them again");
            write!(rows, " {} |", cost(&other["to_a_twentieth_jnd"]))?;
        }
        rows.push('\n');
    }
    Ok(rows)
}

/// Three significant places with the interval; a dash where some run refused a parameter.
fn cost(verdict: &Value) -> String {
    let biases = verdict["biases"].as_array().map_or(&[][..], Vec::as_slice);
    if !biases.is_empty() {
        let biases: Vec<&str> = biases.iter().filter_map(Value::as_str).collect();
        return format!("biased: {}", biases.join(", "));
    }
    let seconds = &verdict["cpu_s"];
    let Some(value) = seconds["value"].as_f64() else { return "–".to_owned() };
    let places = (2.0 - libm::log10(value.max(1e-9)).floor()).clamp(0.0, 9.0) as usize;
    let [low, high] = [0, 1].map(|end| seconds["ci95"][end].as_f64());
    let interval = low.zip(high).map(|(low, high)| format!(" ({low:.places$} … {high:.places$})"));
    format!("{value:.places$}{}", interval.unwrap_or_default())
}

/// Renders one map of `scene` on each of `grids` and leaves the reports.
fn render(scene: &str, packets: &str, grids: [&str; 4]) -> Result<()> {
    let (map, response) = (format!("{FOLDER}/{scene}.sonelmap"), format!("{FOLDER}/{scene}.npz"));
    let file = format!("scenes/{scene}/scene.toml");
    let options = ["--packets", packets, "--quiet"];
    workspace::program(Profile::Release, "sonel-trace", &[&[&file, "-o", &map][..], &options].concat())?;
    for (power, grid) in grids.into_iter().enumerate() {
        let grid = format!("--grid={grid}");
        let words = [&map, "-o", &response, &grid, "--json", "--quiet", "--threads", "1"];
        workspace::write(
            &report(scene, power),
            workspace::program(Profile::Release, "sonel-render", &words)?,
        )?;
    }
    Ok(())
}

/// Where the report of 10^`power` receivers lies.
fn report(scene: &str, power: usize) -> String {
    format!("{FOLDER}/{scene}-1e{power}.json")
}

/// CPU seconds of rendering against the number of receivers, opening the map apart.
fn draw_receivers() -> Result<()> {
    let (mut table, mut series) = ("scene,packets,receivers,cpu_s\n".to_owned(), Vec::new());
    for (scene, packets, grids) in GRIDS {
        let mut points = Vec::new();
        for power in 0..grids.len() {
            let report: Value = serde_json::from_str(&workspace::read(&report(scene, power))?)?;
            let seconds = |key: &str| report["timings"][key].as_f64().context("no timings");
            let (count, spent) = (10_f64.powi(power as i32), seconds("cpu_s")? - seconds("open_cpu_s")?);
            table.push_str(&format!("{scene},{packets},{count},{spent:.4}\n"));
            points.push(Point::new(count, spent));
        }
        series.push(Series::new(format!("{scene}, {packets} packets"), Mark::PointsAndLine, points));
    }
    let mut svg = Vec::new();
    let panel = Panel {
        title: "CPU seconds of rendering".to_owned(),
        x: Axis::logarithmic("receivers"),
        y: Axis::logarithmic("CPU seconds [s]"),
        series,
    };
    plot::svg(&Sheet::single(panel), &mut svg).context("cannot draw")?;
    workspace::write(&format!("{COPIES}/receivers.svg"), svg)?;
    workspace::write(&format!("{COPIES}/receivers.csv"), table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn sweep(name: &str, verdict: &Value) -> Value {
        json!({ "settings": [{ "name": name, "to_a_twentieth_jnd": verdict }] })
    }

    #[test]
    fn costs_have_three_places_and_biased_settings_none() {
        let seconds =
            |value: f64, ci95: [f64; 2]| json!({ "cpu_s": { "value": value, "ci95": ci95 }, "biases": [] });
        let refused = json!({ "cpu_s": { "value": null, "ci95": null }, "biases": [] });
        let biased = json!({ "cpu_s": { "value": 2.0 }, "biases": ["L by +0.23 ± 0.11 dB"] });
        let cells = [seconds(0.4381, [0.327, 0.5859]), seconds(149.77, [87.02, 257.79]), refused, biased];
        let sweeps = cells.map(|verdict| sweep("gather", &verdict));
        assert_eq!(
            costs(&sweeps).unwrap(),
            "| gather | 0.438 (0.327 … 0.586) | 150 (87 … 258) | – | biased: L by +0.23 ± 0.11 dB |\n"
        );
    }

    #[test]
    fn sweeps_of_different_settings_are_an_error() {
        assert!(costs(&[sweep("gather", &Value::Null), sweep("sphere", &Value::Null)]).is_err());
    }
}
