//! `sonel-trace`: traces sonels through a scene and saves the sonel map.

use std::process::ExitCode;

use clap::Parser;
use sonel_console::run_to_exit;

fn main() -> ExitCode {
    let arguments = sonel_trace::Arguments::parse();
    run_to_exit(arguments.quiet, |out, log| sonel_trace::run(&arguments, out, log))
}
