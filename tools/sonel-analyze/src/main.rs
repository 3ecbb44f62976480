//! `sonel-analyze`: inspects maps and responses, reads room-acoustic parameters.

use std::process::ExitCode;

use clap::Parser;
use sonel_console::{log_stream, run_to_exit};

fn main() -> ExitCode {
    let arguments = sonel_analyze::Arguments::parse();
    let mut log = log_stream(arguments.quiet);
    run_to_exit(|| sonel_analyze::run(&arguments, &mut std::io::stdout().lock(), &mut log))
}
