//! Chores of the workspace. `cargo xtask --help` lists them.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a chore reports to the person who runs it")]

mod accept;
mod accuracy;
mod bench;
mod ci;
mod cluster;
mod demo;
mod diffraction;
mod documentation;
mod figures;
mod hall;
mod python;
mod python_reader;
mod tidy;
mod workspace;

use std::process::ExitCode;

use clap::Parser;

/// Chores of the workspace.
#[derive(Parser)]
#[command(name = "cargo xtask")]
enum Chore {
    /// Run what must hold before an issue is closed and takes too long for every change
    Accept,
    /// Run the sweeps behind docs/accuracy.md and draw its plots
    Accuracy {
        /// Only draw again what the last run left in target/accuracy
        #[arg(long)]
        redraw: bool,
    },
    /// Measure speed: rays, segments, connections, bytes; counts first, seconds second
    Bench,
    /// Check everything a change has to pass: format, tidy, lints, tests, Python reader, workflow, documentation
    Ci,
    /// Run workflow/ on a small scene and compare its map with that of the run in one piece
    Cluster,
    /// Trace and render the seed room into target/demo and print its levels and reverberation times
    Demo,
    /// Draw the plots of docs/diffraction.md: laws of screens
    Diffraction,
    /// Repeat the founding paper's experiment and write docs/paper
    Figures {
        /// Only draw again what the last run left in target/paper
        #[arg(long)]
        redraw: bool,
    },
    /// Write scenes/hall/hall.obj and the figures in its README from the plan
    Hall,
    /// Check the Python reader of maps against sonel-render
    PythonReader,
    /// Check the house rules that a program can check
    Tidy,
}

fn main() -> ExitCode {
    let outcome = match Chore::parse() {
        Chore::Accept => accept::run(),
        Chore::Accuracy { redraw } => accuracy::run(redraw),
        Chore::Bench => bench::run(),
        Chore::Ci => ci::run(),
        Chore::Cluster => cluster::check(),
        Chore::Demo => demo::run(),
        Chore::Diffraction => diffraction::run(),
        Chore::Figures { redraw } => figures::run(redraw),
        Chore::Hall => hall::run(),
        Chore::PythonReader => python_reader::check(),
        Chore::Tidy => tidy::run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
