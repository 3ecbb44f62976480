//! What other systems get, on this one; and the oldest Rust that is promised.

use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};

use crate::python::shown;
use xtask::workspace;

/// A folder of its own: other flags compile everything anew.
const FOLDER: &str = "target/portable";

/// Tests the programs with the code for systems without Unix signals (docs/platforms.md), then checks the workspace with the Rust that its
/// manifest states. Where that is not installed: what it needs.
pub(crate) fn accept() -> Result<Option<&'static str>> {
    let mut test = workspace::cargo(&[
        "test",
        "--package",
        "sonel-console",
        "--package",
        "sonel-trace",
        "--target-dir",
        FOLDER,
    ]);
    // Signals and closed streams are those of Unix: what is tested here is all else, and an interruption below.
    test.args(["--lib", "--test", "commands"]).env("RUSTFLAGS", "--cfg sonel_portable -D warnings");
    shown(&mut test)?;
    interrupted()?;

    let manifest: toml::Table = workspace::read("Cargo.toml")?.parse().context("Cargo.toml")?;
    let version =
        manifest["workspace"]["package"]["rust-version"].as_str().context("no rust-version")?.to_owned()
            + ".0";
    let run = |words: &[&str]| {
        let mut rustup = workspace::command("rustup", &["run", &version]);
        rustup.args(words);
        rustup
    };
    if !run(&["rustc", "--version"]).output().is_ok_and(|output| output.status.success()) {
        return Ok(Some(
            "the oldest Rust that is promised: `rustup toolchain install` the rust-version of Cargo.toml",
        ));
    }
    shown(&mut run(&["cargo", "check", "--quiet", "--workspace", "--target-dir", "target/rust-version"]))?;
    println!("portable: other systems' code passes its tests; Rust {version} compiles the workspace");
    Ok(None)
}

/// Interrupts a long trace: it leaves no file and ends with code 130.
fn interrupted() -> Result<()> {
    let folder = workspace::root().join(FOLDER);
    let map = folder.join("interrupted.sonelmap");
    let mut trace = Command::new(folder.join("debug/sonel-trace"));
    trace.args(["scenes/shoebox/scene.toml", "--packets", "20M", "--quiet", "-o"]).arg(&map);
    let mut running = trace.current_dir(workspace::root()).stderr(Stdio::null()).spawn()?;
    std::thread::sleep(std::time::Duration::from_secs(5));
    shown(Command::new("kill").args(["-s", "INT", &running.id().to_string()]))?;
    let ended = running.wait()?;
    let left = std::fs::read_dir(&folder)?
        .flatten()
        .filter(|entry| entry.file_name().to_string_lossy().contains("interrupted"));
    ensure!(
        ended.code() == Some(130) && left.count() == 0,
        "an interrupted trace ends with {ended} and may leave files"
    );
    Ok(())
}
