//! The report in a real browser: no script fails, and every chart is drawn.

use std::fs;
use std::process::Command;

use anyhow::{Result, ensure};

use crate::python::printed;
use xtask::workspace::{self, Profile};

const SCENE: &str = "scenes/shoebox/scene.toml";

/// Opens the report of a small run in Chromium. Where it cannot run: what it needs.
pub fn accept() -> Result<Option<&'static str>> {
    if !Command::new("chromium").arg("--version").output().is_ok_and(|output| output.status.success()) {
        return Ok(Some("the report needs Debian's `chromium`"));
    }
    let programs = workspace::programs(Profile::Dev)?;
    let folder = workspace::root().join("target/report");
    fs::create_dir_all(&folder)?;
    let file = |name: &str| folder.join(name).display().to_string();
    let [map, response, report] = ["a.sonelmap", "a.npz", "a.html"].map(file);
    let run = |name: &str, words: &[&str]| printed(Command::new(programs.join(name)).args(words));
    run("sonel-trace", &[SCENE, "--packets", "2000", "--quiet", "--output", &map])?;
    run("sonel-render", &[&map, "--rays", "1024", "--quiet", "--output", &response])?;
    run("sonel-analyze", &["report", &response, &map, "--output", &report])?;

    let source = fs::read_to_string(&report)?;
    let wanted = source.matches("class=\"chart\"").count();
    let drawn = opened(&report)?.matches("class=\"plot-container").count();
    ensure!(wanted > 0 && drawn == wanted, "{drawn} of {wanted} charts are drawn");
    // A browser that tells of no failure would tell of none here.
    let broken = file("broken.html");
    fs::write(&broken, source.replace("Plotly.react(id", "Nothing.react(id"))?;
    ensure!(opened(&broken).is_err(), "a failing script goes unnoticed");
    println!("report: {drawn} charts, no script fails");
    Ok(None)
}

/// What becomes of a page when its scripts have run.
fn opened(page: &str) -> Result<String> {
    let mut browser = Command::new("chromium");
    browser.args(["--headless", "--no-sandbox", "--use-gl=swiftshader", "--enable-logging=stderr"]);
    browser.args(["--virtual-time-budget=20000", "--dump-dom", &format!("file://{page}")]);
    let run = browser.output()?;
    let log = String::from_utf8_lossy(&run.stderr).into_owned();
    ensure!(!log.contains("Uncaught"), "{log}");
    Ok(String::from_utf8(run.stdout)?)
}
