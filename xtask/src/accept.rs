//! Checks that take too long for every change: documentation, foreign packages, a real Slurm, a container, the Python wheel
//! and its notebook, statistical runs in
//! release.

use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;

use xtask::workspace;

use crate::{
    attack, cluster, container, dist, documentation, fuzz, measured, portable, python_package, site, view,
};

/// A part of what is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Part {
    /// What rustdoc has to say
    Documentation,
    /// What can be published; licences, advisories and sources of foreign packages
    Packages,
    /// The workflow on a real Slurm
    Cluster,
    /// Static programs in a container
    Container,
    /// The house page, and the commands on it
    Site,
    /// A release on a bare Debian
    Dist,
    /// The code for other systems, and the oldest Rust
    Portable,
    /// The Python wheel, its types and its notebook
    Python,
    /// The page of sonel-view in a browser
    View,
    /// Measured impulse responses against pyrato
    Measured,
    /// Programs killed, short of disk and memory, with damaged inputs
    Attack,
    /// Readers of files under a fuzzer, ten minutes each
    Fuzz,
    /// Statistical runs
    Tests,
}

/// Runs one part, or all; ends with what was left out.
pub(crate) fn run(part: Option<Part>) -> Result<()> {
    // What it needs where something of it cannot run.
    type Run = fn() -> Result<Option<&'static str>>;
    let parts: [(Part, Run); 13] = [
        (Part::Documentation, || documentation::check().map(|()| None)),
        (Part::Packages, packages),
        (Part::Cluster, cluster::accept),
        (Part::Container, container::accept),
        (Part::Site, || site::accept().map(|()| None)),
        (Part::Dist, dist::accept),
        (Part::Portable, portable::accept),
        (Part::Python, python_package::accept),
        (Part::View, view::accept),
        (Part::Measured, || measured::accept().map(|()| None)),
        (Part::Attack, || attack::accept().map(|()| None)),
        (Part::Fuzz, fuzz::accept),
        (Part::Tests, || tests().map(|()| None)),
    ];
    let mut left_out = Vec::new();
    for (_, run) in parts.into_iter().filter(|&(name, _)| part.is_none_or(|part| part == name)) {
        left_out.extend(run()?);
    }
    for reason in left_out {
        println!("left out: {reason}");
    }
    Ok(())
}

/// Crate sonel and those below it, lowest first.
const PUBLISHED: [&str; 14] = [
    "sonel-acoustics",
    "sonel-sampling",
    "sonel-geometry",
    "sonel-diffraction",
    "sonel-sofa",
    "sonel-scene",
    "sonel-map",
    "sonel-echogram",
    "sonel-tracer",
    "sonel-renderer",
    "sonel-analysis",
    "sonel-sound",
    "sonel-drawing",
    "sonel",
];

/// Packs what can be published, then compares foreign packages with deny.toml. Where something of it cannot run: what it needs.
fn packages() -> Result<Option<&'static str>> {
    let mut pack = workspace::cargo(&["package", "--no-verify", "--allow-dirty"]);
    pack.args(PUBLISHED.iter().flat_map(|name| ["--package", name]));
    succeed(pack)?;
    // Tests compile crate sonel with every feature; who traces has none.
    succeed(workspace::cargo(&["check", "--package", "sonel-trace"]))?;
    let mut command = workspace::cargo(&["deny", "--version"]);
    if !command.output().is_ok_and(|output| output.status.success()) {
        return Ok(Some("licences and advisories need `cargo install --locked cargo-deny`"));
    }
    succeed(workspace::cargo(&["deny", "check", "licenses", "bans", "sources"]))?;
    if !workspace::cargo(&["deny", "fetch", "db"]).status().is_ok_and(|status| status.success()) {
        return Ok(Some("advisories: their database is on github.com, which cannot be reached"));
    }
    succeed(workspace::cargo(&["deny", "check", "advisories"])).map(|()| None)
}

/// Runs all tests, one after the other, and shows what they measured; of those that continuous integration runs, what it leaves out.
fn tests() -> Result<()> {
    let in_release = |arguments: &[&str]| {
        let (build, run) =
            (["test", "--release", "--package", "sonel-tests"], ["--nocapture", "--test-threads=1"]);
        succeed(workspace::cargo(&[&build, arguments, &run].concat()))
    };
    // Campaigns of drawings are larger in release.
    let drawings =
        ["--package", "sonel-geometry", "--test", "rays", "--test", "shape", "--package", "sonel-tracer"];
    in_release(&[&["--test", "accept"], &drawings[..], &["--test", "readable", "--"]].concat())?;
    let with_units = ["--package", "sonel-testkit", "--package", "sonel-diffraction", "--lib"];
    let ours = ["--test", "physics", "--test", "stability"];
    in_release(&[&ours, &with_units[..], &["--", "--ignored"]].concat())
}

fn succeed(mut command: Command) -> Result<()> {
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{command:?}: {status}");
    Ok(())
}
