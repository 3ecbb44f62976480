//! Pages as chores: `cargo xtask` starts `cargo pages` for those that are asked for by that name.

use std::process::ExitCode;

use anyhow::Context;

use xtask::workspace;

/// Runs `cargo pages PAGE ARGUMENTS` where the chore was started; returns its exit code, the message is its own.
pub(crate) fn run(page: &str, arguments: &[String]) -> anyhow::Result<ExitCode> {
    let mut pages = workspace::cargo(&["run", "--quiet", "--package", "pages", "--", page]);
    pages.args(arguments).current_dir(std::env::current_dir()?);
    let status = pages.status().with_context(|| format!("cannot run {pages:?}"))?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
