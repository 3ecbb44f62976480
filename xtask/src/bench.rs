//! Speed, measured: the benchmarks of the workspace, in release, one after the other.

use std::process::Command;

use anyhow::{Context, Result, ensure};

use xtask::workspace;

use crate::python;

/// The benchmark that is compared with Embree, and where it leaves its rays.
const RAYS: [&str; 2] = ["rays", "target/rays"];

/// Runs all benchmarks, that of rays alone, or only `parts` of that of speed.
pub fn run(parts: &[String]) -> Result<()> {
    let mut command = workspace::cargo(&["bench", "--package", "sonel-tests"]);
    let rays_alone = parts == [RAYS[0]];
    if rays_alone {
        command.args(["--bench", RAYS[0]]);
    } else if !parts.is_empty() {
        command.args(["--bench", "speed", "--"]).args(parts);
    }
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{command:?}: {status}");
    if rays_alone || parts.is_empty() { compare_with_embree() } else { Ok(()) }
}

/// Casts the same rays with Embree and prints both rates.
fn compare_with_embree() -> Result<()> {
    let programs = python::environment("target/embree", "tests/benches/requirements.txt")?;
    python::shown(Command::new(programs.join("python")).args(["tests/benches/embree.py", RAYS[1]]))
}
