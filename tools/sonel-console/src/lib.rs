//! What the programs share: clocks, choices, counts, times, plans, inputs that are files, outputs that appear when complete, scenes, progress,
//! exit codes.

pub mod choices;
pub mod clock;
pub mod count;
pub mod input;
pub mod output;
pub mod plan;
pub mod progress;
pub mod scene;
pub mod store;
pub mod time;

use std::io::Write;
use std::process::ExitCode;

/// How a program ended, when nothing was wrong with its input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done: exit code 0.
    Done,
    /// Done, but a requested tolerance or comparison failed: exit code 1.
    Missed,
}

/// The exit code of `result`; an error is printed to stderr with its causes and is code 2.
#[must_use]
pub fn exit_code(result: anyhow::Result<Outcome>) -> ExitCode {
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
