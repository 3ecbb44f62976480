//! `sonel-trace`: traces packets through a scene and saves the sonel map.

use std::process::ExitCode;

use sonel_console::{parse, run_to_exit};

fn main() -> ExitCode {
    let program = parse::<sonel_trace::Program>();
    run_to_exit(program.is_quiet(), |out, log| program.run(out, log))
}
