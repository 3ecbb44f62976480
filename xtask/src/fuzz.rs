//! Readers of files fuzzed by libFuzzer under the address sanitizer, from the seeds of `fuzz/seeds`.
//!
//! A find ends its reader with an error; libFuzzer states where the input lies. CONTRIBUTING.md says what becomes of it.

use std::fs;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

use xtask::workspace;

/// Seconds for each reader in `accept`, on one core.
pub(crate) const SECONDS: u32 = 600;
/// Most memory of a reader [MB], and the longest time for one input [s]: inputs have at most 4 kB where seeds are smaller.
const LIMITS: [&str; 2] = ["-rss_limit_mb=2048", "-timeout=20"];

/// As users run them: with debug assertions a parser of foreign make (winnow, behind sofar) panics where it means to return an error.
const RELEASE: &str = "--release";
/// Added to the flags of cargo-fuzz: sums that overflow are finds.
const FLAGS: &str = "-Coverflow-checks=on";

/// Fuzzes all readers for [`SECONDS`] each. Where it cannot: what it needs.
pub(crate) fn accept() -> Result<Option<&'static str>> {
    let mut version = fuzz(&["--version"]);
    if !version.output().is_ok_and(|output| output.status.success()) {
        return Ok(Some("fuzzing needs `cargo install --locked cargo-fuzz`"));
    }
    run(SECONDS, &[]).map(|()| None)
}

/// Fuzzes `readers`, or all, for so many seconds each.
pub(crate) fn run(seconds: u32, readers: &[String]) -> Result<()> {
    let all = targets()?;
    if let Some(unknown) = readers.iter().find(|reader| !all.contains(reader)) {
        bail!("no fuzz target \"{unknown}\": there are {}", all.join(", "));
    }
    let built = fuzz(&["build", RELEASE]).status().context("cannot run cargo fuzz")?;
    ensure!(built.success(), "the fuzz targets do not compile: {built}");
    let mut found = Vec::new();
    for reader in all.iter().filter(|reader| readers.is_empty() || readers.contains(reader)) {
        let [corpus, seeds] = ["corpus", "seeds"].map(|folder| format!("fuzz/{folder}/{reader}"));
        fs::create_dir_all(workspace::root().join(&corpus))?;
        let time = format!("-max_total_time={seconds}");
        let mut command = fuzz(&["run", RELEASE, reader, &corpus]);
        if workspace::root().join(&seeds).exists() {
            command.arg(seeds);
        }
        command.args(["--", &time, "-print_final_stats=1", LIMITS[0], LIMITS[1]]);
        let output =
            command.stdout(Stdio::inherit()).output().with_context(|| format!("cannot run {command:?}"))?;
        let log = String::from_utf8_lossy(&output.stderr);
        let inputs = log.lines().find_map(|line| line.strip_prefix("stat::number_of_executed_units:"));
        println!("{reader}: {} inputs in {seconds} s: {}", inputs.unwrap_or(" no").trim(), output.status);
        if !output.status.success() {
            eprintln!("{log}");
            found.push(reader.as_str());
        }
    }
    if found.is_empty() { Ok(()) } else { bail!("found in: {}", found.join(", ")) }
}

/// Names of the fuzz targets.
fn targets() -> Result<Vec<String>> {
    let entries = fs::read_dir(workspace::root().join("fuzz/fuzz_targets"))?;
    let names: Result<Vec<_>, std::io::Error> = entries.map(|entry| Ok(entry?.path())).collect();
    let stem = |path: std::path::PathBuf| Some(path.file_stem()?.to_string_lossy().into_owned());
    let mut names: Vec<String> = names?.into_iter().filter_map(stem).collect();
    names.sort();
    Ok(names)
}

/// cargo-fuzz with the compiler of the workspace, whose sanitizers are unstable.
fn fuzz(arguments: &[&str]) -> Command {
    let mut command = workspace::command("cargo", &["fuzz"]);
    command.args(arguments).env("RUSTFLAGS", FLAGS).env("RUSTC_BOOTSTRAP", "1");
    command
}
