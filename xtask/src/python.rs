//! Python environments under target/, so that no check depends on what a machine happens to have.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Mutex;

use anyhow::{Context, Result, ensure};

use xtask::workspace;

/// One installation after the other.
static INSTALLING: Mutex<()> = Mutex::new(());

/// The folder of programs of the environment in `folder`, in which the packages listed in the file `requirements` are
/// installed.
pub(crate) fn environment(folder: &str, requirements: &str) -> Result<PathBuf> {
    let programs = workspace::root().join(folder).join(if cfg!(windows) { "Scripts" } else { "bin" });
    let wanted = fs::read_to_string(workspace::root().join(requirements))?;
    let _one = INSTALLING.lock();
    let stamp = workspace::root().join(folder).join("installed.txt");
    if fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
        return Ok(programs);
    }
    let system = if cfg!(windows) { "python" } else { "python3" };
    printed(Command::new(system).args(["-m", "venv", folder]))?;
    let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r", requirements];
    printed(Command::new(programs.join("python")).args(install))?;
    fs::write(stamp, wanted)?;
    Ok(programs)
}

/// Runs `command` in the workspace; what it prints to stdout.
pub(crate) fn printed(command: &mut Command) -> Result<String> {
    let run = command.current_dir(workspace::root()).stderr(Stdio::inherit());
    let output = run.output().with_context(|| format!("cannot run {run:?}"))?;
    ensure!(output.status.success(), "{run:?}: {}", output.status);
    String::from_utf8(output.stdout).with_context(|| format!("{run:?} printed no UTF-8"))
}

/// Runs `command` in the workspace; what it prints is seen, also where it fails.
pub(crate) fn shown(command: &mut Command) -> Result<()> {
    let status = command.current_dir(workspace::root()).status();
    let status = status.with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{command:?}: {status}");
    Ok(())
}
