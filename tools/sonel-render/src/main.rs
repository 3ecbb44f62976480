//! `sonel-render`: renders echograms at any receivers from a sonel map.

use std::process::ExitCode;

use clap::Parser;
use sonel_console::{log_stream, run_to_exit};

fn main() -> ExitCode {
    let arguments = sonel_render::Arguments::parse();
    let mut log = log_stream(arguments.quiet);
    run_to_exit(|| sonel_render::run(&arguments, &mut std::io::stdout().lock(), &mut log))
}
