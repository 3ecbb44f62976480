//! `sonel-view`: shows a room, its map and its responses in the browser.

use std::process::ExitCode;

use sonel_console::{parse, run_to_exit};

fn main() -> ExitCode {
    let arguments = parse::<sonel_view::Arguments>();
    run_to_exit(arguments.common.quiet, |out, log| sonel_view::run(&arguments, out, log))
}
