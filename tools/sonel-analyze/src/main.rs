//! `sonel-analyze`: inspects maps and responses, reads room-acoustic parameters.

use std::process::ExitCode;

use clap::Parser;
use sonel_console::run_to_exit;

fn main() -> ExitCode {
    let arguments = sonel_analyze::Arguments::parse();
    run_to_exit(arguments.quiet, |out, log| sonel_analyze::run(&arguments, out, log))
}
