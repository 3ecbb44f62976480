//! What the programs share: clocks, choices, counts, times, plans, inputs that are files, outputs that appear when complete, interruptions, scenes, progress,
//! exit codes.

pub mod choices;
pub mod clock;
pub mod count;
pub mod feasible;
pub mod input;
pub mod interrupt;
pub mod output;
pub mod plan;
pub mod progress;
pub mod quantity;
pub mod scene;
pub mod store;
pub mod time;

use std::io::Write;
use std::process::ExitCode;

use anyhow::Context;

/// How a program ended, when nothing was wrong with its input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done: exit code 0.
    Done,
    /// Done, but a requested tolerance or comparison failed: exit code 1.
    Missed,
}

/// Runs a program; its outputs that are not complete go when it is interrupted.
pub fn run_to_exit(program: impl FnOnce() -> anyhow::Result<Outcome>) -> ExitCode {
    let ready = interrupt::remove_unfinished_files().context("cannot handle signals");
    exit_code(ready.and_then(|()| program()))
}

/// The exit code of `result`; an error is printed to stderr with its causes and is code 2.
fn exit_code(result: anyhow::Result<Outcome>) -> ExitCode {
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Missed) => ExitCode::from(1),
        // Whoever read stdout has seen enough (`… | head`): that is no failure.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            // A reader that went away (a closed pipe) cannot be told either.
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let broken = |cause: &std::io::Error| cause.kind() == std::io::ErrorKind::BrokenPipe;
    error.chain().any(|cause| cause.downcast_ref::<std::io::Error>().is_some_and(broken))
}

/// Where a program logs to: stderr, or nowhere with `--quiet`.
#[must_use]
pub fn log_stream(quiet: bool) -> Box<dyn Write> {
    if quiet { Box::new(std::io::sink()) } else { Box::new(std::io::stderr()) }
}

/// Most threads of a program: far more than cores only cost memory and switches.
const MOST_THREADS: usize = 1024;

/// Parses a number of threads.
///
/// # Errors
/// A sentence for the user where `text` is no number of 1 … 1024.
pub fn parse_threads(text: &str) -> Result<usize, String> {
    match text.trim().parse() {
        Ok(threads) if (1..=MOST_THREADS).contains(&threads) => Ok(threads),
        _ => Err(format!("give 1 … {MOST_THREADS} threads, or leave the option out for all cores")),
    }
}

/// Uses `threads` threads for all parallel work of this process; all cores where none is given.
///
/// # Errors
/// When the threads cannot be started.
pub fn use_threads(threads: Option<usize>) -> anyhow::Result<()> {
    if let Some(threads) = threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    }
    Ok(())
}

/// Wall and CPU seconds since its start.
#[derive(Debug)]
pub struct Stopwatch {
    wall: std::time::Instant,
    cpu: cpu_time::ProcessTime,
}

impl Stopwatch {
    /// Starts.
    #[must_use]
    pub fn start() -> Self {
        Self { wall: std::time::Instant::now(), cpu: cpu_time::ProcessTime::now() }
    }

    /// (wall, CPU of all threads) [s].
    #[must_use]
    pub fn seconds(&self) -> (f64, f64) {
        (self.wall.elapsed().as_secs_f64(), self.cpu.elapsed().as_secs_f64())
    }
}
