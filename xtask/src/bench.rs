//! Speed, measured: the benchmarks of the workspace, in release, one after the other.

use anyhow::{Context, Result, ensure};

use xtask::workspace;

/// Runs all benchmarks.
pub fn run() -> Result<()> {
    let mut command = workspace::cargo(&["bench", "--package", "sonel-tests"]);
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{command:?}: {status}");
    Ok(())
}
