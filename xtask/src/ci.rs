//! Everything a change has to pass, one step after the other, with its time.
//!
//! A failed step does not stop the later ones: whoever reads the log learns everything that is wrong.

use std::io::Write;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};

use xtask::workspace::{self, Profile};

use crate::{cluster, python_reader, site, tidy};

/// Runs all steps; an error names those that failed.
pub(crate) fn run() -> Result<()> {
    let start = Instant::now();
    workspace::lint_while_compiling();
    // Packages arrive while crates are compiled. Who needs them installs them anew where this failed, and says why.
    std::thread::spawn(|| python_reader::environment().and(cluster::environment()).and(site::environment()));
    let mut failed = Vec::new();
    for (name, check) in steps() {
        println!("── {name}");
        let begun = Instant::now();
        let outcome = check();
        if let Err(error) = &outcome {
            eprintln!("{error:#}");
            failed.push(name);
        }
        let verdict = if outcome.is_ok() { "ok" } else { "FAILED" };
        println!("── {name}: {verdict} in {:.1} s\n", begun.elapsed().as_secs_f64());
    }
    println!("── all steps: {:.1} s", start.elapsed().as_secs_f64());
    if !failed.is_empty() {
        bail!("failed: {}", failed.join(", "));
    }
    Ok(())
}

type Step = (&'static str, fn() -> Result<()>);

/// Cheapest first.
fn steps() -> [Step; 5] {
    [
        ("format", || succeed(workspace::cargo(&["fmt", "--all", "--check"]))),
        ("tidy", tidy::run),
        ("build and lints", || {
            succeed(workspace::cargo(&[
                "test",
                "--workspace",
                "--all-targets",
                "--no-run",
                "--no-fail-fast",
            ]))?;
            // Not among all targets, as nobody runs it by the way.
            succeed(workspace::cargo(&["test", "--workspace", "--test", "accept", "--no-run"]))
        }),
        ("examples", examples),
        ("tests, Python, workflow", tests),
    ]
}

/// Runs the tests, and beside them chores that mostly wait for one core. Their output follows that of the tests.
fn tests() -> Result<()> {
    let chores = std::thread::spawn(|| ["site", "python-reader", "python-package", "cluster"].map(captured));
    let tested = succeed(workspace::cargo(&["test", "--workspace", "--tests", "--no-fail-fast"]));
    let chores = chores.join().expect("a chore that fails is an error");
    let failed: Vec<String> = [tested]
        .into_iter()
        .chain(chores)
        .filter_map(|outcome| Some(format!("{:#}", outcome.err()?)))
        .collect();
    ensure!(failed.is_empty(), "{}", failed.join("\n"));
    Ok(())
}

/// Runs a chore of this program and shows its output when it has ended.
fn captured(chore: &str) -> Result<()> {
    let begun = Instant::now();
    let mut command = workspace::linting(&std::env::current_exe()?.to_string_lossy(), &[chore]);
    let output = command.output().with_context(|| format!("cannot run {command:?}"))?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "── {chore}: {} in {:.1} s", output.status, begun.elapsed().as_secs_f64())?;
    out.write_all(&output.stdout)?;
    out.write_all(&output.stderr)?;
    ensure!(output.status.success(), "{chore}: {}", output.status);
    Ok(())
}

/// Runs the examples of crate sonel, each with few packets.
fn examples() -> Result<()> {
    succeed(workspace::cargo(&["build", "--quiet", "--workspace", "--examples"]))?;
    let folder = workspace::programs(Profile::Dev)?.join("examples");
    ["1-shoebox-to-t30", "2-map-reused-for-a-grid", "3-materials-after-the-trace"].iter().try_for_each(
        |example| succeed(workspace::command(&folder.join(example).to_string_lossy(), &["1000"])),
    )
}

fn succeed(mut command: Command) -> Result<()> {
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    ensure!(status.success(), "{command:?}: {status}");
    Ok(())
}
