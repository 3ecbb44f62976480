//! `sonel-analyze`: inspects maps and responses, reads room-acoustic parameters.

use std::process::ExitCode;

use sonel_console::{parse, run_to_exit};

fn main() -> ExitCode {
    let arguments = parse::<sonel_analyze::Arguments>();
    run_to_exit(arguments.quiet, |out, log| sonel_analyze::run(&arguments, out, log))
}
