//! Long statistical runs, the Python wheel and its notebook, in release, and the documentation.

use anyhow::{Context, Result, ensure};

use xtask::workspace;

use crate::{documentation, python_package};

/// Runs all of them, one test after the other, and shows what they measured; before that, what rustdoc has to say.
pub fn run() -> Result<()> {
    documentation::check()?;
    let arguments = [
        "test",
        "--release",
        "--package",
        "sonel-tests",
        "--test",
        "accept",
        "--package",
        "sonel-geometry",
        "--test",
        "rays",
        "--",
        "--nocapture",
        "--test-threads=1",
    ];
    let mut command = workspace::cargo(&arguments);
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{command:?}: {status}");
    python_package::accept()
}
