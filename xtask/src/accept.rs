//! Checks that take too long for every change: documentation, foreign packages, a real Slurm, a container, the Python wheel
//! and its notebook, statistical runs in
//! release.

use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;

use xtask::workspace;

use crate::{cluster, container, documentation, python_package, report};

/// A part of what is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// What rustdoc has to say
    Documentation,
    /// Licences, advisories and sources of foreign packages
    Packages,
    /// The workflow on a real Slurm
    Cluster,
    /// Static programs in a container
    Container,
    /// The Python wheel, its types and its notebook
    Python,
    /// The report in a browser
    Report,
    /// Statistical runs
    Tests,
}

/// Runs one part, or all.
pub fn run(part: Option<Part>) -> Result<()> {
    let is_wanted = |wanted: Part| part.is_none_or(|part| part == wanted);
    if is_wanted(Part::Documentation) {
        documentation::check()?;
    }
    if is_wanted(Part::Packages) {
        packages()?;
    }
    if is_wanted(Part::Cluster) {
        cluster::accept()?;
    }
    if is_wanted(Part::Container) {
        container::accept()?;
    }
    if is_wanted(Part::Python) {
        python_package::accept()?;
    }
    if is_wanted(Part::Report) {
        report::accept()?;
    }
    if is_wanted(Part::Tests) { tests() } else { Ok(()) }
}

/// Compares foreign packages with deny.toml.
fn packages() -> Result<()> {
    let mut command = workspace::cargo(&["deny", "--version"]);
    if !command.output().is_ok_and(|output| output.status.success()) {
        println!("left out: licences and advisories need `cargo install --locked cargo-deny`");
        return Ok(());
    }
    succeed(workspace::cargo(&["deny", "check", "licenses", "bans", "sources"]))?;
    if !workspace::cargo(&["deny", "fetch", "db"]).status().is_ok_and(|status| status.success()) {
        println!("left out: advisories need github.com");
        return Ok(());
    }
    succeed(workspace::cargo(&["deny", "check", "advisories"]))
}

/// Runs all tests, one after the other, and shows what they measured; of those that continuous integration runs, what it leaves out.
fn tests() -> Result<()> {
    let in_release = |arguments: &[&str]| {
        let (build, run) =
            (["test", "--release", "--package", "sonel-tests"], ["--nocapture", "--test-threads=1"]);
        succeed(workspace::cargo(&[&build, arguments, &run].concat()))
    };
    in_release(&["--test", "accept", "--package", "sonel-geometry", "--test", "rays", "--"])?;
    in_release(&["--test", "physics", "--", "--ignored"])
}

fn succeed(mut command: Command) -> Result<()> {
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{command:?}: {status}");
    Ok(())
}
