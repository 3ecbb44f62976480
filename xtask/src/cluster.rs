//! The workflow and the Slurm script of workflow/, run here on a small scene: what they join is the run in one piece.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::python::{self, printed};
use xtask::workspace::{self, Profile};

const REQUIREMENTS: &str = "workflow/requirements.txt";
const ENVIRONMENT: &str = "target/cluster/python";
const FOLDER: &str = "target/cluster/run";
const SCENE: &str = "scenes/shoebox/scene.toml";
/// Ten chunks, so that four shards are of different sizes.
const SONELS: &str = "5000";
const SHARDS: u32 = 4;

/// Installs Snakemake; the folder of its programs.
pub fn environment() -> Result<PathBuf> {
    python::environment(ENVIRONMENT, REQUIREMENTS)
}

/// Makes a run in one piece, by Snakemake and by the script; compares.
pub fn check() -> Result<()> {
    let snakemake = environment()?.join("snakemake");
    let programs = workspace::programs(Profile::Dev)?;
    let folder = workspace::root().join(FOLDER);
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;

    let whole = trace(&programs, &folder.join("whole.sonelmap"), "1")?;
    let other = trace(&programs, &folder.join("other.sonelmap"), "2")?;
    ensure!(whole != other, "another seed goes unnoticed: the comparison is blind");

    with_snakemake(&snakemake, &programs, &folder)?;
    ensure!(
        fs::read(folder.join("snakemake/map.sonelmap"))? == whole,
        "the workflow's map is not that of the run in one piece"
    );
    let parameters = fs::read_to_string(folder.join("snakemake/parameters.json"))?;
    serde_json::from_str::<serde_json::Value>(&parameters)
        .context("the workflow's parameters are no JSON")?;
    println!("Snakemake: {SHARDS} shards joined equal the run in one piece, {} bytes", whole.len());

    with_script(&programs, &folder)?;
    ensure!(
        fs::read(folder.join("slurm/map.sonelmap"))? == whole,
        "the script's map is not that of the run in one piece"
    );
    println!("slurm.sh: the same");
    Ok(())
}

/// The map of the run in one piece.
fn trace(programs: &Path, map: &Path, seed: &str) -> Result<Vec<u8>> {
    let mut command = Command::new(programs.join("sonel-trace"));
    command.args([SCENE, "--sonels", SONELS, "--seed", seed, "--quiet", "-o"]).arg(map);
    printed(&mut command)?;
    Ok(fs::read(map)?)
}

fn with_snakemake(snakemake: &Path, programs: &Path, folder: &Path) -> Result<()> {
    let mut command = Command::new(snakemake);
    command.args([
        "--snakefile",
        "workflow/Snakefile",
        "--cores",
        "2",
        "--quiet",
        "all",
        "--show-failed-logs",
    ]);
    command.arg("--directory").arg(folder).arg("--config").args([
        format!("scene={}", workspace::root().join(SCENE).display()),
        format!("programs={}", programs.display()),
        format!("sonels={SONELS}"),
        format!("shards={SHARDS}"),
        "output=snakemake".to_owned(),
    ]);
    printed(&mut command).map(drop)
}

/// The script as Slurm calls it: once for every task of the array, once more to join.
fn with_script(programs: &Path, folder: &Path) -> Result<()> {
    let path = env::var_os("PATH").unwrap_or_default();
    let path = env::join_paths([programs.to_owned()].into_iter().chain(env::split_paths(&path)))?;
    for task in (1..=SHARDS).map(Some).chain([None]) {
        let mut command = Command::new("bash");
        command.args(["workflow/slurm.sh", &SHARDS.to_string(), SCENE]);
        command.arg(folder.join("slurm")).arg(SONELS).env("PATH", &path).env_remove("SLURM_ARRAY_TASK_ID");
        if let Some(task) = task {
            command.env("SLURM_ARRAY_TASK_ID", task.to_string()).arg("--quiet");
        }
        printed(&mut command)?;
    }
    Ok(())
}
