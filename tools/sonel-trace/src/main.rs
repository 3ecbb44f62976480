//! `sonel-trace`: traces sonels through a scene and saves the sonel map.

use std::process::ExitCode;

use clap::Parser;
use sonel_console::{log_stream, run_to_exit};

fn main() -> ExitCode {
    let arguments = sonel_trace::Arguments::parse();
    let mut log = log_stream(arguments.quiet);
    run_to_exit(|| sonel_trace::run(&arguments, &mut std::io::stdout().lock(), &mut log))
}
