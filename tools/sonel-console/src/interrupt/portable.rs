//! Interruptions where signals are no files and no numbers: Ctrl-C and the end of the console, by the crate ctrlc. A mapped file that is cut off ends
//! the program without a word.

/// Number that stands for Ctrl-C in exit codes, as on Unix.
const INTERRUPTED: i32 = 2;

/// Calls `interrupted` when Ctrl-C is pressed.
pub(super) fn handle(interrupted: fn(i32, Option<&str>) -> !) -> std::io::Result<()> {
    ctrlc::set_handler(move || interrupted(INTERRUPTED, None)).map_err(std::io::Error::other)
}

/// Ends the program, which failed at its end.
pub(super) fn fail() -> ! {
    std::process::abort()
}
