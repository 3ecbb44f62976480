//! `sonel-analyze inspect`.

mod response;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use sonel_console::Outcome;

use crate::open;

/// Arguments of `inspect`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:\n  sonel-analyze inspect room.npz")]
pub struct Arguments {
    /// The response.
    #[arg(value_name = "RESPONSE.npz")]
    pub input: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Prints what a file holds.
///
/// # Errors
/// When the file cannot be read, or `out` not written.
pub fn run(arguments: &Arguments, out: &mut dyn Write) -> anyhow::Result<Outcome> {
    let response = open::response(&arguments.input)?;
    if arguments.json {
        writeln!(out, "{:#}", response::json(&response))?;
    } else {
        out.write_all(response::text(&response).as_bytes())?;
    }
    Ok(Outcome::Done)
}
