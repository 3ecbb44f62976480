//! Chores of the workspace. `cargo xtask --help` lists them.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a chore reports to the person who runs it")]

mod hall;
mod workspace;

use anyhow::Result;
use clap::Parser;

/// Chores of the workspace.
#[derive(Parser)]
#[command(name = "cargo xtask")]
enum Chore {
    /// Write scenes/hall/hall.obj and the figures in its README from the plan
    Hall,
}

fn main() -> Result<()> {
    match Chore::parse() {
        Chore::Hall => hall::run(),
    }
}
