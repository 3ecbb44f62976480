//! `sonel-trace`: traces sonels through a scene and saves the sonel map.

use std::process::ExitCode;

use clap::Parser;
use sonel_console::{exit_code, log_stream};

fn main() -> ExitCode {
    let arguments = sonel_trace::Arguments::parse();
    let mut log = log_stream(arguments.quiet);
    exit_code(sonel_trace::run(&arguments, &mut std::io::stdout().lock(), &mut log))
}
