//! The workflow and the Slurm script of workflow/, run here on a small scene: what they join is the run in one piece.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::python::{self, printed};
use crate::slurm::{Process, Slurm};
use xtask::workspace::{self, Profile};

const REQUIREMENTS: &str = "workflow/requirements.txt";
const ENVIRONMENT: &str = "target/cluster/python";
const FOLDER: &str = "target/cluster/run";
const SCENE: &str = "scenes/shoebox/scene.toml";
/// The slowest tasks of a real Slurm shall last long enough to be cancelled.
const MORE_PACKETS: &str = "200k";
/// Ten chunks, so that four shards are of different sizes.
const PACKETS: &str = "5000";
const SHARDS: u32 = 4;

/// Installs Snakemake; the folder of its programs.
pub(crate) fn environment() -> Result<PathBuf> {
    python::environment(ENVIRONMENT, REQUIREMENTS)
}

/// Makes a run in one piece, by Snakemake and by the script; compares.
pub(crate) fn check() -> Result<()> {
    let programs = workspace::programs(Profile::Dev)?;
    let folder = workspace::root().join(FOLDER);
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;

    let whole = trace(&programs, &folder.join("whole.sonelmap"), PACKETS, "1")?;
    let other = trace(&programs, &folder.join("other.sonelmap"), PACKETS, "2")?;
    ensure!(whole != other, "another seed goes unnoticed: the comparison is blind");

    let config = format!("packets={PACKETS}");
    printed(snakemake(&programs, &folder)?.args([&config, "--cores", "2", "--quiet", "all"]))?;
    ensure!(
        fs::read(folder.join("snakemake/map.sonelmap"))? == whole,
        "the workflow's map is not that of the run in one piece"
    );
    let parameters = fs::read_to_string(folder.join("snakemake/parameters.json"))?;
    serde_json::from_str::<serde_json::Value>(&parameters)
        .context("the workflow's parameters are no JSON")?;
    println!("Snakemake: {SHARDS} shards joined equal the run in one piece, {} bytes", whole.len());

    of_rooms(&programs, &folder)?;
    with_script(&programs, &folder)?;
    ensure!(
        fs::read(folder.join("slurm/map.sonelmap"))? == whole,
        "the script's map is not that of the run in one piece"
    );
    println!("slurm.sh: the same");
    Ok(())
}

/// The map of the run in one piece.
fn trace(programs: &Path, map: &Path, packets: &str, seed: &str) -> Result<Vec<u8>> {
    let mut command = Command::new(programs.join("sonel-trace"));
    command.args([SCENE, "--packets", packets, "--seed", seed, "--quiet", "-o"]).arg(map);
    printed(&mut command)?;
    Ok(fs::read(map)?)
}

/// Snakemake, with results in the folder `snakemake` of `folder`; the last option is `--config`, which takes more.
fn snakemake(programs: &Path, folder: &Path) -> Result<Command> {
    let mut command = Command::new(environment()?.join("snakemake"));
    command.args(["--snakefile", "workflow/Snakefile", "--show-failed-logs", "--directory"]).arg(folder);
    command.arg("--config").args([
        format!("scene={}", workspace::root().join(SCENE).display()),
        format!("programs={}", programs.display()),
        format!("shards={SHARDS}"),
        "output=snakemake".to_owned(),
    ]);
    Ok(command)
}

/// What Snakemake plans for a folder of two rooms: for each the files of a single scene. Two rooms of one name are refused.
fn of_rooms(programs: &Path, folder: &Path) -> Result<()> {
    for room in ["rooms/first.toml", "rooms/second/scene.toml"] {
        let file = folder.join(room);
        fs::create_dir_all(file.parent().context("a file is in a folder")?)?;
        fs::copy(workspace::root().join(SCENE), file)?;
    }
    let plan = |rooms: &str| -> Result<Command> {
        let mut command = snakemake(programs, folder)?;
        command.args([rooms, "output=many", "--cores", "2", "--dry-run", "--quiet", "host"]);
        Ok(command)
    };
    let planned = printed(&mut plan("rooms=rooms")?)?;
    for room in ["first", "second"] {
        for file in ["parameters.json".to_owned(), format!("shards/{SHARDS}-of-{SHARDS}.sonelmap")] {
            ensure!(
                planned.contains(&format!("many/{room}/{file}")),
                "{room}/{file} is not planned: {planned}"
            );
        }
    }
    let refused = plan("rooms=[a/first.toml,b/first.toml]")?.current_dir(workspace::root()).output()?;
    let says = |output: &Vec<u8>| String::from_utf8_lossy(output).contains("would both write");
    ensure!(
        // Versions of Snakemake differ in where they print errors.
        !refused.status.success() && [&refused.stdout, &refused.stderr].into_iter().any(says),
        "two rooms of one name are not refused: {refused:?}"
    );
    println!("Snakemake: two rooms are planned, each in a folder of its own");
    Ok(())
}

/// The script as Slurm calls it: to decide, once for every task of the array, to join.
fn with_script(programs: &Path, folder: &Path) -> Result<()> {
    let folder = folder.join("slurm");
    fs::create_dir_all(folder.join("shards"))?;
    let stages = [("decide", 1..=1), ("trace", 1..=SHARDS), ("join", 1..=1)];
    for (stage, task) in stages.into_iter().flat_map(|(stage, tasks)| tasks.map(move |task| (stage, task))) {
        let mut command = script(programs, &folder, SHARDS, PACKETS)?;
        printed(command.env("SONEL_STAGE", stage).env("SLURM_ARRAY_TASK_ID", task.to_string()))?;
    }
    Ok(())
}

/// `workflow/slurm.sh`, which finds `programs`.
fn script(programs: &Path, folder: &Path, shards: u32, packets: &str) -> Result<Command> {
    let mut command = Command::new(workspace::root().join("workflow/slurm.sh"));
    command.args([&shards.to_string(), SCENE]).arg(folder).args([packets, "--quiet"]);
    command.env("PATH", path_with(programs)?);
    Ok(command)
}

/// The `PATH`, with a folder before the others.
fn path_with(folder: &Path) -> Result<OsString> {
    let path = env::var_os("PATH").unwrap_or_default();
    Ok(env::join_paths([folder.to_owned()].into_iter().chain(env::split_paths(&path)))?)
}

/// The same on a real Slurm, with faults: a task is cancelled, the node fails, Snakemake is killed. Where it cannot run: what it needs.
pub(crate) fn accept() -> Result<Option<&'static str>> {
    let Some(slurm) = Slurm::start(&workspace::root().join("target/cluster/daemons"))? else {
        return Ok(Some("a real Slurm needs root and Debian's `slurm-wlm` and `munge`"));
    };
    let programs = workspace::programs(Profile::Dev)?;
    let folder = workspace::root().join("target/cluster/accept");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    let whole = trace(&programs, &folder.join("whole.sonelmap"), MORE_PACKETS, "1")?;
    let same = |map: &Path, what: &str| -> Result<()> {
        ensure!(fs::read(map).with_context(|| format!("{what}: no map"))? == whole, "{what}: another map");
        println!("{what}: the map of the run in one piece");
        Ok(())
    };
    let submit = |shards: u32, name: &str| -> Result<()> {
        let mut command = script(&programs, &folder.join(name), shards, MORE_PACKETS)?;
        printed(command.envs(slurm.environment())).map(drop)
    };
    submit(1, "single")?;
    slurm.settle()?;
    same(&folder.join("single/map.sonelmap"), "one shard")?;

    submit(SHARDS, "failed")?;
    slurm.running(is_task)?;
    slurm.fail_node()?;
    slurm.settle()?;
    same(&folder.join("failed/map.sonelmap"), "a node that failed")?;

    submit(SHARDS, "cancelled")?;
    let (task, _) = slurm.running(is_task)?;
    slurm.cancel(&task)?;
    slurm.settle()?;
    ensure!(!folder.join("cancelled/map.sonelmap").exists(), "shards were joined without one");
    let again = |stage: &str, options: &[&str]| -> Result<()> {
        let whole = script(&programs, &folder.join("cancelled"), SHARDS, MORE_PACKETS)?;
        let mut command = slurm.client("sbatch");
        command.args(options).arg(whole.get_program()).args(whole.get_args());
        command
            .env("SONEL_STAGE", stage)
            .envs(whole.get_envs().filter_map(|(key, value)| Some((key, value?))));
        printed(&mut command)?;
        slurm.settle()
    };
    let (_, number) = task.split_once('_').context("no task of an array")?;
    again("trace", &["--output=/dev/null", &format!("--array={number}")])?;
    again("join", &["--output=/dev/null"])?;
    same(&folder.join("cancelled/map.sonelmap"), "a cancelled task")?;

    with_profile(&slurm, &programs, &folder)?;
    same(&folder.join("snakemake/map.sonelmap"), "Snakemake, with a cancelled job and killed")?;
    Ok(None)
}

/// Whether a line of `Slurm::running` is that of a task of an array.
fn is_task(line: &str) -> bool {
    line.split(' ').next().is_some_and(|job| job.contains('_'))
}

/// The profile for Slurm: a cancelled job is repeated; after Snakemake was killed it is called again as docs/scale.md says.
fn with_profile(slurm: &Slurm, programs: &Path, folder: &Path) -> Result<()> {
    let with = |options: &[&str]| -> Result<Command> {
        let mut command = snakemake(programs, folder)?;
        let profile = workspace::root().join("workflow/profiles/slurm");
        command.args([&format!("packets={MORE_PACKETS}"), "--slurm-init-seconds-before-status-checks", "5"]);
        command.args(options).arg("--profile").arg(profile).current_dir(workspace::root());
        command.envs(slurm.environment()).env("PATH", path_with(slurm.folder())?);
        Ok(command)
    };
    let first = Process::start(&mut with(&[])?)?;
    let (cancelled, shard) = slurm.running(|line| line.contains("trace"))?;
    slurm.cancel(&cancelled)?;
    slurm.running(|line| line.ends_with(&shard) && !line.starts_with(&cancelled))?;
    drop(first);
    slurm.settle()?;
    ensure!(!folder.join("snakemake/map.sonelmap").exists(), "Snakemake was not killed in time");
    printed(&mut with(&["--unlock"])?)?;
    printed(&mut with(&[])?).map(drop)
}
