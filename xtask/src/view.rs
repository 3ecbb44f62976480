//! The page of `sonel-view` in a real browser: no script fails, charts are drawn, and what a user does on it gives the numbers of the programs.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::python::printed;
use xtask::workspace::{self, Profile};

/// Scenes that the page is driven in.
const SCENES: [&str; 5] = ["shoebox", "seed-room", "office", "hall", "church"];

/// Drives the page of each scene in Chromium. Where it cannot run: what it needs.
pub(crate) fn accept() -> Result<Option<&'static str>> {
    let is_there =
        |name: &str| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success());
    if !["chromium", "node", "npm"].into_iter().all(is_there) {
        return Ok(Some("the page needs Debian's `chromium`, `nodejs` and `npm`"));
    }
    let programs = workspace::programs(Profile::Release)?;
    let folder = workspace::root().join("target/view");
    fs::create_dir_all(&folder)?;
    frozen(&programs, &folder)?;
    fs::copy(workspace::root().join("xtask/src/view.mjs"), folder.join("view.mjs"))?;
    let packages = ["install", "--silent", "playwright-core@1", "axe-core@4", "--prefix"];
    printed(workspace::command("npm", &packages).arg(&folder))?;
    report(&programs, &folder)?;
    for scene in SCENES {
        driven(&programs, &folder, scene)?;
    }
    Ok(None)
}

/// Opens the frozen page of a small run.
fn frozen(programs: &Path, folder: &Path) -> Result<()> {
    let page = folder.join("frozen.html").display().to_string();
    let scene = workspace::root().join("scenes/shoebox/scene.toml").display().to_string();
    let words = [&scene, "--packets", "2000", "--quiet", "--output", &page];
    printed(Command::new(programs.join("sonel-view")).args(words))?;
    let source = fs::read_to_string(&page)?;
    let drawn = opened(&page)?.matches("<figure class=\"chart\"").count();
    // The design, and of the pair: decay, echogram, early reflections, a parameter over frequency.
    ensure!(drawn == 5, "{drawn} of 5 charts are drawn");
    // A browser that tells of no failure would tell of none here.
    let broken = folder.join("broken.html").display().to_string();
    fs::write(&broken, source.replace("Plot.plot(", "Nothing.plot("))?;
    ensure!(opened(&broken).is_err(), "a failing script goes unnoticed");
    println!("frozen page: {drawn} charts, no script fails");
    Ok(())
}

/// Writes the report of two designs with targets and long names at three seats.
fn report(programs: &Path, folder: &Path) -> Result<()> {
    let scene = workspace::root().join("scenes/classroom/scene.toml").display().to_string();
    let [map, hard, tiles] = ["class.sonelmap", "class.npz", "class-tiles.npz"]
        .map(|name| folder.join(name).display().to_string());
    let run = |program: &str, words: &[&str]| {
        printed(Command::new(programs.join(program)).args(words).arg("--quiet")).map(drop)
    };
    run("sonel-trace", &[&scene, "--packets", "2000", "-o", &map])?;
    run("sonel-render", &[&map, "-o", &hard, "--variant", "all"])?;
    let page = folder.join("report.html").display().to_string();
    let head = ["--project", "School in the old town, room 12", "--author", "Studio", "--revision", "1"];
    let files = [&hard, &tiles, &map, "-o", &page, "--target", "din18041-a3", "--target", "sti>=0.6"];
    // Between hard walls targets are failed, which the exit code says.
    let status = Command::new(programs.join("sonel-view")).args(files).args(head).arg("--quiet").status()?;
    ensure!(status.code() == Some(1), "sonel-view: {status}");
    Ok(())
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

/// Does on the page of `scene` what a user does, then runs the commands that it gave and compares their times with those it showed.
fn driven(programs: &Path, folder: &Path, scene: &str) -> Result<()> {
    let own = folder.join(scene);
    // Saved files of an earlier run would only be counted on.
    let _ = fs::remove_dir_all(&own);
    fs::create_dir_all(&own)?;
    for entry in fs::read_dir(workspace::root().join("scenes").join(scene))? {
        let entry = entry?;
        fs::copy(entry.path(), own.join(entry.file_name()))?;
    }
    let mut drive = Command::new("node");
    let page = folder.join("report.html");
    drive.args([folder.join("view.mjs"), programs.join("sonel-view"), own.join("scene.toml"), own, page]);
    let measured: Value = serde_json::from_str(&printed(&mut drive)?)?;
    let mut output = String::new();
    for command in measured["commands"].as_array().context("no commands")? {
        let line = command.as_str().context("a command is no text")?;
        let is_reading = line.starts_with("sonel-analyze");
        let line = format!(
            "{}/{line}{}",
            programs.display(),
            if is_reading { " --format json" } else { " --quiet" }
        );
        output = printed(Command::new("sh").args(["-c", &line]))?;
    }
    let read: Value = serde_json::from_str(&output)?;
    let bands = read["receivers"][0]["bands"].as_array().context("no bands")?;
    for (band, shown) in bands.iter().zip(measured["t30_s"].as_array().context("no times")?) {
        ensure!(
            band["t30_s"]["value"] == *shown,
            "{scene}: the page shows {shown}, the programs {}",
            band["t30_s"]
        );
    }
    println!("{scene}: {} {}", measured["latency_ms"], measured["acts"]);
    Ok(())
}
