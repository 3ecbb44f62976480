//! `sonel-render`: renders echograms at any receivers from a sonel map.

use std::process::ExitCode;

use clap::Parser;
use sonel_console::{exit_code, log_stream};

fn main() -> ExitCode {
    let arguments = sonel_render::Arguments::parse();
    let mut log = log_stream(arguments.quiet);
    exit_code(sonel_render::run(&arguments, &mut std::io::stdout().lock(), &mut log))
}
