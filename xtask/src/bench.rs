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

/// The benchmark of commands; folders of other builds may follow.
const COMMANDS: &str = "commands";

/// Runs all benchmarks, that of rays, of impulse responses or of commands alone, or only `parts` of that of speed.
pub(crate) fn run(parts: &[String]) -> Result<()> {
    if let Some((PEERS, rooms)) = parts.split_first().map(|(first, rest)| (first.as_str(), rest)) {
        return compare_with_peers(rooms);
    }
    if let Some((COMMANDS, others)) = parts.split_first().map(|(first, rest)| (first.as_str(), rest)) {
        return commands::compare(others);
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
    compare_with_peers(&[])
}

/// Casts the same rays with Embree and prints both rates.
fn compare_with_embree() -> Result<()> {
    let programs = python::environment("target/embree", "tests/benches/requirements.txt")?;
    python::shown(Command::new(programs.join("python")).args(["tests/benches/embree.py", RAYS[1]]))
}

/// Makes impulse responses of the same rooms with the Python package and with pyroomacoustics; prints CPU time and T30.
fn compare_with_peers(rooms: &[String]) -> Result<()> {
    let python = python::environment("target/peers", "tests/benches/peers-requirements.txt")?.join("python");
    python_package::install_wheel(&python)?;
    python::shown(Command::new(python).arg("tests/benches/peers.py").args(rooms))
}
