//! Runs the jobs of `workflow/` on the hall and writes the table of docs/scale.md.
//!
//! GNU time measures the CPU time and the peak memory of every job. Memory includes those pages of a map that the job has read.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};
use xtask::workspace::{self, Profile};

const SCENE: &str = "scenes/hall/scene.toml";
const FOLDER: &str = "target/scale";
const PAGE: &str = "docs/scale.md";
/// Emissions and shards of workflow/config.yaml.
const PACKETS: &str = "1M";
const SHARDS: u32 = 8;
/// Jobs that share the receivers.
const PARTS: u32 = 2;

/// What a job takes: CPU time [s], memory [MB], file [MB].
type Cost = [f64; 3];

/// Runs the jobs one after the other.
pub(crate) fn run() -> Result<()> {
    fs::create_dir_all(workspace::root().join(FOLDER))?;
    let programs = workspace::programs(Profile::Release)?;
    let [decision, map, response] =
        ["decision.sonelmap", "map.sonelmap", "response.npz"].map(|name| format!("{FOLDER}/{name}"));
    let trace = |options: &[&str], output: &str| {
        measure(programs.join("sonel-trace"), &[&[SCENE], options].concat(), output)
    };
    let merge = |inputs: &[String], output: &str| {
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        measure(programs.join("sonel-analyze"), &[&["merge"], &inputs[..]].concat(), output)
    };
    let decide = trace(&["--packets", "1"], &decision)?;
    let (shards, tracing) = parts(SHARDS, "sonelmap", |shard, output| {
        trace(&["--packets", PACKETS, "--shard", shard, "--decision", &decision], output)
    })?;
    let merging = merge(&shards, &map)?;
    let (pieces, rendering) = parts(PARTS, "npz", |part, output| {
        measure(programs.join("sonel-render"), &[&map, "--shard", part], output)
    })?;
    let joining = merge(&pieces, &response)?;

    let mut table = "| job | CPU time [s] | memory [MB] | file [MB] |\n|---|---|---|---|\n".to_owned();
    for (name, [seconds, memory, size]) in [
        ("decide about effects".to_owned(), decide),
        (format!("trace one of {SHARDS} shards"), tracing),
        ("merge the shards".to_owned(), merging),
        (format!("render one of {PARTS} parts"), rendering),
        ("join the parts".to_owned(), joining),
    ] {
        table += &format!("| {name} | {seconds:.1} | {memory:.0} | {size:.1} |\n");
    }
    print!("{table}");
    workspace::write(PAGE, workspace::with_figures(&workspace::read(PAGE)?, &table)?)
}

/// Runs all parts of a kind; their files, and the cost of the one that takes the most CPU time.
fn parts(count: u32, ending: &str, run: impl Fn(&str, &str) -> Result<Cost>) -> Result<(Vec<String>, Cost)> {
    let mut most = Cost::default();
    let mut files = Vec::new();
    for part in 1..=count {
        let file = format!("{FOLDER}/{part}.{ending}");
        let cost = run(&format!("{part}/{count}"), &file)?;
        most = if cost[0] > most[0] { cost } else { most };
        files.push(file);
    }
    Ok((files, most))
}

/// Runs a program with an output.
fn measure(program: PathBuf, arguments: &[&str], output: &str) -> Result<Cost> {
    let said = format!("{FOLDER}/time.txt");
    let mut command = workspace::command("time", &["--format", "%U %S %M", "--output", &said]);
    command.arg(program).args(arguments).args(["--quiet", "-o", output]);
    let status = command.status().context("cannot run GNU time: install the package `time`")?;
    anyhow::ensure!(status.success(), "{command:?}: {status}");
    let figures: Vec<f64> =
        workspace::read(&said)?.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
    let [user, system, kib] = figures[..] else { anyhow::bail!("{said} has not three figures") };
    let bytes = fs::metadata(workspace::root().join(output))?.len() as f64;
    Ok([user + system, kib * 1024.0 / 1e6, bytes / 1e6])
}
