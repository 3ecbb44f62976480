//! Speed, measured: the benchmarks of the workspace, in release, one after the other.

use anyhow::{Context, Result, ensure};

use xtask::workspace;

/// Runs all benchmarks, or only `parts` of that of speed.
pub fn run(parts: &[String]) -> Result<()> {
    let mut command = workspace::cargo(&["bench", "--package", "sonel-tests"]);
    if !parts.is_empty() {
        command.args(["--bench", "speed", "--"]).args(parts);
    }
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{command:?}: {status}");
    Ok(())
}
