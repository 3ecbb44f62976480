//! Shared by `cargo xtask` and `cargo pages`.
#![allow(clippy::print_stderr, reason = "a chore reports to the person who runs it")]

pub mod workspace;

use std::process::ExitCode;

/// The exit code of a chore; an error is printed to stderr with its causes.
#[must_use]
pub fn exit_code(outcome: anyhow::Result<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
