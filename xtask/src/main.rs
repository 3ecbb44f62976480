//! Chores of the workspace. `cargo xtask --help` lists them.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a chore reports to the person who runs it")]

mod accept;
mod attack;
mod bench;
mod ci;
mod cluster;
mod container;
mod demo;
mod dist;
mod documentation;
mod fuzz;
mod measured;
mod pages;
mod portable;
mod python;
mod python_package;
mod python_reader;
mod site;
mod slurm;
mod tidy;
mod view;

use std::process::ExitCode;

use clap::Parser;

/// Chores of the workspace.
#[derive(Parser)]
#[command(name = "cargo xtask")]
enum Chore {
    /// Run the long checks: documentation, packages, cluster, Python, statistics
    Accept {
        /// One part alone
        part: Option<accept::Part>,
    },
    /// Measure speed: rays, segments, connections, bytes
    Bench {
        /// `rays` alone, `peers` (and a number of rooms) alone, `unbiased` (and a number of seeds) alone, `commands` (and folders of programs of other builds) alone, or parts of the speed benchmark: shoebox, seed-room, hall, what-if, edges
        parts: Vec<String>,
    },
    /// Check everything a change has to pass: format, tidy, lints, tests, Python, workflow
    Ci,
    /// Run workflow/ on a small scene and compare its map with that of the run in one piece
    Cluster,
    /// Trace and render the concert hall into target/demo and print levels, reverberation times, clarity and STI
    Demo {
        /// The room of the founding paper instead of the hall
        #[arg(long)]
        paper: bool,
    },
    /// Make a release in target/dist: static programs, wheel, sources, checksums
    Dist,
    /// Fuzz readers of files with cargo-fuzz
    Fuzz {
        /// Seconds for each reader
        #[arg(long, default_value_t = fuzz::SECONDS)]
        seconds: u32,
        /// Readers (fuzz/fuzz_targets); all without one
        readers: Vec<String>,
    },
    /// Test the Python package sonel against the programs
    PythonPackage,
    /// Check the Python reader of maps against sonel-render
    PythonReader,
    /// Build the house page of docs/ in target/site, without a network when it is read
    Site,
    /// Check the house rules that a program can check
    Tidy,
    /// Compare packets with measured rooms in data sets of others: `cargo pages validate`
    Validate {
        /// The folder with the data sets, and options of `cargo pages validate`
        #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
}

fn main() -> ExitCode {
    let outcome = match Chore::parse() {
        Chore::Accept { part } => accept::run(part),
        Chore::Bench { parts } => bench::run(&parts),
        Chore::Ci => ci::run(),
        Chore::Cluster => cluster::check(),
        Chore::Demo { paper } => demo::run(paper),
        Chore::Dist => dist::make(),
        Chore::Fuzz { seconds, readers } => fuzz::run(seconds, &readers),
        Chore::PythonPackage => python_package::check(),
        Chore::PythonReader => python_reader::check(),
        Chore::Site => site::build(),
        Chore::Tidy => tidy::run(),
        Chore::Validate { arguments } => {
            return pages::run("validate", &arguments).unwrap_or_else(|error| xtask::exit_code(Err(error)));
        }
    };
    xtask::exit_code(outcome)
}
