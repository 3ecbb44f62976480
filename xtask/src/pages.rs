//! Pages as chores: `cargo xtask` starts `cargo pages` for those that issues and pages ask for by that name.

use anyhow::{Context, Result, ensure};

use xtask::workspace;

/// Runs `cargo pages PAGE ARGUMENTS`. Paths are relative to where the chore was started.
pub fn run(page: &str, arguments: &[String]) -> Result<()> {
    let mut pages = workspace::cargo(&["run", "--quiet", "--package", "pages", "--", page]);
    pages.args(arguments).current_dir(std::env::current_dir()?);
    let status = pages.status().with_context(|| format!("cannot run {pages:?}"))?;
    ensure!(status.success(), "cargo pages {page}: {status}");
    Ok(())
}
