//! `sonel-trace`: traces packets through a scene and saves the sonel map.

use std::process::ExitCode;

use clap::Parser;
use sonel_console::run_to_exit;

fn main() -> ExitCode {
    let program = sonel_trace::Program::parse();
    run_to_exit(program.is_quiet(), |out, log| program.run(out, log))
}
