//! `sonel-render`: renders echograms at any receivers from a sonel map.

use std::process::ExitCode;

use sonel_console::{parse, run_to_exit};

fn main() -> ExitCode {
    let arguments = parse::<sonel_render::Arguments>();
    run_to_exit(arguments.common.quiet, |out, log| sonel_render::run(&arguments, out, log))
}
