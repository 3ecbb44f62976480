//! The sweeps behind docs/accuracy.md: what accuracy costs in the shipped scenes, by estimator, by β, and by receivers.
//!
//! Everything goes to target/accuracy; pages, plots and tables are copied to docs/accuracy.

use anyhow::{Context, Result};
use serde_json::Value;
use sonel_analysis::plot::{self, Axis, Mark, Panel, Point, Series, Sheet};

use xtask::workspace::{self, Profile};

const FOLDER: &str = "target/accuracy";
const PAGES: &str = "docs/accuracy";
/// What a sweep leaves that a page shows; the rest is large.
const KEPT: [&str; 6] =
    ["README.md", "deviation.svg", "bias.svg", "efficiency.svg", "cost.svg", "tradeoff.csv"];

const ESTIMATORS: [&str; 4] = ["--estimator", "auto,connection,gather,sphere", "--mode", "accurate,paper"];
const SURVIVALS: [&str; 2] = ["--survival", "0.15,0,0.05,0.4,1"];

/// Scenes with the sonels and repeats that take a few minutes each.
const SCENES: [(&str, &str, &str); 3] =
    [("shoebox", "1k,4k,16k,64k", "12"), ("seed-room", "1k,4k,16k", "10"), ("hall", "8k,32k", "5")];

/// Grids of 1, 10, 100 and 1000 receivers in each scene, and the sonels they are rendered from.
const GRIDS: [(&str, &str, [&str; 4]); 3] = [
    ("shoebox", "4k", ["7,5,1.2", "1:9:5,1:6:2,1.2", "1:9:10,1:6:10,1.2", "1:9:10,1:6:10,0.5:2.5:10"]),
    ("seed-room", "1k", ["60,9,60", "38:66:5,9,4:66:2", "38:66:10,9,4:66:10", "38:66:10,2:28:10,4:66:10"]),
    ("hall", "1k", ["0,20,4", "-5:5:5,15:20:2,4", "-5:5:10,12:22:10,4", "-5:5:10,12:22:10,4:7:10"]),
];

/// Runs all sweeps, about twenty minutes on a quiet machine, unless older runs are to be drawn again; then copies what the pages
/// show.
pub fn run(redraw: bool) -> Result<()> {
    std::fs::create_dir_all(workspace::root().join(FOLDER))?;
    for (scene, sonels, repeats) in SCENES {
        for (what, varied) in [("estimators", &ESTIMATORS[..]), ("survival", &SURVIVALS)] {
            if !redraw {
                sweep(scene, what, varied, sonels, repeats)?;
            }
            keep(&format!("{scene}-{what}"))?;
        }
    }
    for (scene, sonels, grids) in GRIDS {
        if !redraw {
            render(scene, sonels, grids)?;
        }
    }
    draw_receivers()
}

fn sweep(scene: &str, what: &str, varied: &[&str], sonels: &str, repeats: &str) -> Result<()> {
    let (file, name) = (format!("scenes/{scene}/scene.toml"), format!("{scene}-{what}"));
    let folder = format!("{FOLDER}/{name}");
    let options = [
        "--sonels",
        sonels,
        "--repeats",
        repeats,
        "--effects",
        "auto,-diffraction,-bending",
        "--threads",
        "1",
    ];
    let words = ["tradeoff", &file, "-o", &folder];
    workspace::program(Profile::Release, "sonel-analyze", &[&words[..], varied, &options].concat()).map(drop)
}

/// Copies what a page shows of the sweep called `name`.
fn keep(name: &str) -> Result<()> {
    KEPT.iter().try_for_each(|kept| {
        let text = workspace::read(&format!("{FOLDER}/{name}/{kept}"))?;
        workspace::write(&format!("{PAGES}/{name}/{kept}"), text)
    })
}

/// Renders one map of `scene` on each of `grids` and leaves the reports.
fn render(scene: &str, sonels: &str, grids: [&str; 4]) -> Result<()> {
    let (map, response) = (format!("{FOLDER}/{scene}.sonelmap"), format!("{FOLDER}/{scene}.npz"));
    let file = format!("scenes/{scene}/scene.toml");
    let options = ["--sonels", sonels, "--effects", "auto,-bending", "--quiet"];
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
    let (mut table, mut series) = ("scene,sonels,receivers,cpu_s\n".to_owned(), Vec::new());
    for (scene, sonels, grids) in GRIDS {
        let mut points = Vec::new();
        for power in 0..grids.len() {
            let report: Value = serde_json::from_str(&workspace::read(&report(scene, power))?)?;
            let seconds = |key: &str| report["timings"][key].as_f64().context("no timings");
            let (count, spent) = (10_f64.powi(power as i32), seconds("cpu_s")? - seconds("open_cpu_s")?);
            table.push_str(&format!("{scene},{sonels},{count},{spent:.4}\n"));
            points.push(Point::new(count, spent));
        }
        series.push(Series::new(format!("{scene}, {sonels} sonels"), Mark::PointsAndLine, points));
    }
    let mut svg = Vec::new();
    let panel = Panel {
        title: "CPU seconds of rendering".to_owned(),
        x: Axis::logarithmic("receivers"),
        y: Axis::logarithmic("CPU seconds [s]"),
        series,
    };
    plot::svg(&Sheet::single(panel), &mut svg).context("cannot draw")?;
    workspace::write(&format!("{PAGES}/receivers.svg"), svg)?;
    workspace::write(&format!("{PAGES}/receivers.csv"), table)
}
