//! The founding paper's experiment: its figures 3 and 4, in its mode and in ours, side by side.
//!
//! [Kapralos2006] section 4: sound level at the receiver over 3 s, and simulation time, against the number of sonels, for six
//! bands. Each condition is one `sonel-analyze tradeoff`; drawings, tables and the page go to docs/paper.

mod tables;

use anyhow::{Context, Result};
use serde_json::Value;
use sonel_drawing::plot::{self, Axis, Mark, Panel, Point, Series, Sheet};

use xtask::workspace::{self, Profile};

const SCENE: &str = "scenes/seed-room/scene.toml";
const FOLDER: &str = "target/paper";
const PAGE: &str = "docs/paper/README.md";
/// The counts of the paper, and those for conditions beside its own.
const COUNTS: &str = "10k,100k,500k,1M,2M";
const FEWER: &str = "10k,100k,500k";

/// A condition: name, effects, counts.
const CONDITIONS: [(&str, &str, &str); 3] = [
    ("still air", "auto,-diffraction", COUNTS),
    ("air at 20 °C and 50 %", "auto,-diffraction,+air", FEWER),
    ("with diffraction", "auto,+diffraction", FEWER),
];

/// The settings compared, as `tradeoff` calls them, and the packets that it emits for one sonel: the paper's mode emits N in each
/// of the six bands.
const MODES: [(&str, f64); 2] = [("paper", 6.0), ("accurate", 1.0)];

/// A condition with what came out of it.
struct Condition {
    name: &'static str,
    json: Value,
}

/// Runs the experiment, unless an older run is to be drawn again, and rewrites docs/paper.
pub(crate) fn run(redraw: bool) -> Result<()> {
    if !redraw {
        CONDITIONS.into_iter().try_for_each(conduct)?;
    }
    let conditions: Vec<Condition> = CONDITIONS.into_iter().map(conducted).collect::<Result<_>>()?;
    draw("docs/paper/figure-3.svg", &levels(&conditions)?)?;
    draw("docs/paper/figure-4.svg", &times(&conditions[0])?)?;
    workspace::write("docs/paper/figure-3.csv", tables::levels_csv(&conditions)?)?;
    workspace::write("docs/paper/figure-4.csv", tables::times_csv(&conditions)?)?;
    let figures = tables::markdown(&conditions)?;
    workspace::write(PAGE, workspace::with_figures(&workspace::read(PAGE)?, &figures)?)?;
    print!("{figures}");
    Ok(())
}

fn conduct((name, effects, counts): (&str, &str, &str)) -> Result<()> {
    std::fs::create_dir_all(workspace::root().join(FOLDER))?;
    let folder = folder(name);
    let options = ["--duration", "3", "--repeats", "2", "--reference", "200k", "--effects", effects];
    let words = ["tradeoff", SCENE, "-o", &folder, "--mode", "accurate,paper", "--packets", counts];
    workspace::program(Profile::Release, "sonel-analyze", &[&words[..], &options].concat()).map(drop)
}

fn conducted((name, _, _): (&'static str, &str, &str)) -> Result<Condition> {
    let json = serde_json::from_str(&workspace::read(&format!("{}/tradeoff.json", folder(name)))?)?;
    Ok(Condition { name, json })
}

fn folder(name: &str) -> String {
    format!("{FOLDER}/{}", name.replace([' ', '°', '%'], ""))
}

fn draw(path: &str, sheet: &Sheet) -> Result<()> {
    let mut svg = Vec::new();
    plot::svg(sheet, &mut svg).with_context(|| format!("cannot draw {path}"))?;
    workspace::write(path, svg)
}

/// Figure 3: a row a condition, a panel a mode, a series a band.
fn levels(conditions: &[Condition]) -> Result<Sheet> {
    let panel = |condition: &Condition, mode: &str| -> Result<Panel> {
        let levels = tables::levels(&condition.json, mode)?;
        let mut bands: Vec<f64> = levels.iter().map(|level| level.center_frequency_hz).collect();
        bands.sort_by(f64::total_cmp);
        bands.dedup();
        let series = bands.into_iter().map(|band| {
            let of_band = levels.iter().filter(|level| level.center_frequency_hz.total_cmp(&band).is_eq());
            let points = of_band.map(|level| Point::within(level.sonels, level.mean, level.half_width));
            Series::new(format!("{band} Hz"), Mark::PointsAndLine, points.collect())
        });
        Ok(Panel {
            title: format!("{mode}, {}", condition.name),
            x: Axis::logarithmic("sonels").with_ticks(vec![1e4, 1e5, 5e5, 2e6]),
            y: Axis::linear("level over 3 s [dB]"),
            series: series.collect(),
        })
    };
    let row = |condition| MODES.iter().map(|(mode, _)| panel(condition, mode)).collect::<Result<Vec<_>>>();
    Ok(Sheet::new(
        "Level at the receiver against the number of sonels",
        conditions.iter().map(row).collect::<Result<_>>()?,
    ))
}

/// Figure 4: CPU seconds with error bars, and the lines through them.
fn times(condition: &Condition) -> Result<Sheet> {
    let mut series = Vec::new();
    for (mode, packets) in MODES {
        let times = tables::times(&condition.json, mode, packets)?;
        let points = times.points.iter().map(|time| Point::within(time.sonels, time.mean, time.half_width));
        series.push(Series::new(name(mode), Mark::Points, points.collect()));
        let ends = [0.0, times.points.last().map_or(0.0, |time| time.sonels)];
        let line = ends.map(|sonels| Point::new(sonels, times.overhead + times.per_sonel[0] * sonels));
        series.push(Series::new(format!("line, {}", name(mode)), Mark::Dashed, line.into()));
    }
    Ok(Sheet::single(Panel {
        title: "CPU time against the number of sonels".to_owned(),
        x: Axis::linear("sonels"),
        y: Axis::linear("CPU seconds [s]"),
        series,
    }))
}

fn name(mode: &str) -> String {
    match mode {
        "paper" => "paper, one band".to_owned(),
        _ => format!("{mode}, all bands"),
    }
}
