//! `sonel-analyze`: inspects maps and responses, reads room-acoustic parameters.

use std::process::ExitCode;

use clap::Parser;
use sonel_console::{exit_code, log_stream};

fn main() -> ExitCode {
    let arguments = sonel_analyze::Arguments::parse();
    let mut log = log_stream(arguments.quiet);
    exit_code(sonel_analyze::run(&arguments, &mut std::io::stdout().lock(), &mut log))
}
