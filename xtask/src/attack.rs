//! Programs under attack: killed at random times, given damaged files, short of disk and of memory. The counts go to docs/stability.md.
//!
//! Random numbers are fixed, when a signal arrives is not. Every run has to end by itself or by the signal, with exit code 0, 1 or 2 otherwise; under
//! the name of every output there is the old file or the new one, complete; nothing panics.

mod cases;
mod runs;

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};

use xtask::workspace::{self, Profile};

use cases::{INPUTS, PROGRAMS};
use runs::Ground;

const PAGE: &str = "docs/stability.md";
/// Repetitions of an attack on a program, and damaged copies of an input.
const REPETITIONS: usize = 24;
const COPIES: usize = 150;
/// Pairs of runs with one output.
const PAIRS: usize = 12;

/// What an attack did.
#[derive(Default)]
pub(crate) struct Tally {
    runs: usize,
    /// Runs that did their work.
    done: usize,
    /// Runs that ended with a message or by the signal.
    ended: usize,
    violations: Vec<String>,
}

impl Tally {
    /// Counts a run.
    pub(crate) fn count(&mut self, is_done: bool, violation: Option<String>) {
        self.runs += 1;
        self.done += usize::from(is_done && violation.is_none());
        self.ended += usize::from(!is_done && violation.is_none());
        self.violations.extend(violation);
    }
}

/// Runs the campaign and writes its table.
pub(crate) fn accept() -> Result<()> {
    let programs = workspace::programs(Profile::Release)?;
    let ground = Ground::prepare(&programs, &folder())?;
    let mut random = Random(1);
    let mut rows = Vec::new();
    let mut attack = |name: &str, what: String, tally: Tally| {
        println!(
            "{name}: {} runs, {} done, {} ended, {:?}",
            tally.runs, tally.done, tally.ended, tally.violations
        );
        rows.push((name.to_owned(), what, tally));
    };
    let all = || format!("{} commands", PROGRAMS.len());
    attack("`kill -9`, Ctrl-C, `kill` at a random time", all(), ground.kills(&mut random, REPETITIONS)?);
    attack(
        "disk full after a random size (RLIMIT_FSIZE)",
        all(),
        ground.full_disks(&mut random, REPETITIONS)?,
    );
    attack("24 … 200 MiB of address space", all(), ground.small_memories(&mut random, REPETITIONS)?);
    attack("reader of stdout or stderr gone, disk full below", all(), ground.broken_streams()?);
    attack("two runs at once", all(), ground.pairs(PAIRS)?);
    let inputs = format!("{} kinds of input", INPUTS.len());
    attack("pipe, device, folder, 3 GiB, UTF-16", inputs.clone(), ground.no_files()?);
    for (name, damage) in [
        ("a flipped bit", runs::flipped as runs::Damage),
        ("a cut", runs::cut),
        ("two bytes swapped", runs::swapped),
        ("a part repeated", runs::repeated),
    ] {
        attack(name, inputs.clone(), ground.damage(damage, &mut random, COPIES)?);
    }
    let lines = rows.iter().map(|(name, what, Tally { runs, done, ended, violations })| {
        format!("| {name} | {what} | {runs} | {done} | {ended} | {} |\n", violations.len())
    });
    let head = "| attack | on | runs | done | ended in order | violations |\n|---|---|---|---|---|---|\n";
    let table = lines.fold(head.to_owned(), |table, line| table + &line);
    workspace::write(PAGE, workspace::with_block(&workspace::read(PAGE)?, "attack", &table)?)?;
    let found: Vec<&String> = rows.iter().flat_map(|(_, _, tally)| &tally.violations).collect();
    ensure!(found.is_empty(), "{} violations: {found:#?}", found.len());
    Ok(())
}

fn folder() -> PathBuf {
    workspace::root().join("target/attack")
}

/// Random numbers by the multiplier of Knuth's MMIX.
pub(crate) struct Random(u64);

impl Random {
    /// A number below `end`.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % end.max(1)
    }
}

/// The files of a folder and its folders, by their path.
pub(crate) fn files(folder: &Path) -> Result<Vec<(PathBuf, Vec<u8>)>> {
    let mut found = Vec::new();
    for entry in folder.read_dir()? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(files(&path)?);
            continue;
        }
        match std::fs::read(&path) {
            Ok(bytes) => found.push((path, bytes)),
            // Of two runs at once the other has meanwhile given its file the final name.
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(error.into()),
        }
    }
    found.sort();
    Ok(found)
}
