//! Speed, measured: the benchmarks of the workspace, in release, one after the other.

mod commands;

use std::process::Command;

use anyhow::{Context, Result, ensure};

use xtask::workspace;

use crate::{python, python_package};

/// The benchmark that is compared with Embree, and where it leaves its rays.
const RAYS: [&str; 2] = ["rays", "target/rays"];

/// The benchmark of impulse responses against pyroomacoustics; a number of rooms may follow.
const PEERS: &str = "peers";

/// The benchmark of time to accuracy against programs without bias; a number of seeds may follow. One of them is free for noncommercial use
/// alone, so it runs only when it is asked for.
const UNBIASED: &str = "unbiased";

/// The benchmark of commands; folders of other builds may follow.
const COMMANDS: &str = "commands";

/// Runs all benchmarks, that of rays, of impulse responses or of commands alone, or only `parts` of that of speed.
pub(crate) fn run(parts: &[String]) -> Result<()> {
    match parts.split_first().map(|(first, rest)| (first.as_str(), rest)) {
        Some((name @ (PEERS | UNBIASED), numbers)) => return compare_with(name, numbers),
        Some((COMMANDS, others)) => return commands::compare(others),
        _ => {}
    }
    let mut command = workspace::cargo(&["bench", "--package", "sonel-tests"]);
    let rays_alone = parts == [RAYS[0]];
    if rays_alone {
        command.args(["--bench", RAYS[0]]);
    } else if !parts.is_empty() {
        command.args(["--bench", "speed", "--"]).args(parts);
    }
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{command:?}: {status}");
    if rays_alone || parts.is_empty() {
        compare_with_embree()?;
    }
    if !parts.is_empty() {
        return Ok(());
    }
    commands::compare(&[])?;
    compare_with(PEERS, &[])
}

/// Casts the same rays with Embree and prints both rates.
fn compare_with_embree() -> Result<()> {
    let programs = python::environment("target/embree", "tests/benches/requirements.txt")?;
    python::shown(Command::new(programs.join("python")).args(["tests/benches/embree.py", RAYS[1]]))
}

/// Has the Python package and other programs compute the same rooms, by the script of that name; prints what they cost.
fn compare_with(name: &str, numbers: &[String]) -> Result<()> {
    let requirements = format!("tests/benches/{name}-requirements.txt");
    let python = python::environment(&format!("target/{name}"), &requirements)?.join("python");
    python_package::install_wheel(&python)?;
    python::shown(Command::new(python).arg(format!("tests/benches/{name}.py")).args(numbers))
}
