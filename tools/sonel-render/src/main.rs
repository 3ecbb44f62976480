//! `sonel-render`: renders echograms at any receivers from a sonel map.

use std::process::ExitCode;

use clap::Parser;
use sonel_console::run_to_exit;

fn main() -> ExitCode {
    let arguments = sonel_render::Arguments::parse();
    run_to_exit(arguments.quiet, |out, log| sonel_render::run(&arguments, out, log))
}
