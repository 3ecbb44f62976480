//! Interruptions where signals are no files and no numbers: Ctrl-C and the end of the console, by the crate ctrlc. A mapped file that is cut off ends
//! the program without a word.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Number that stands for Ctrl-C in exit codes, as on Unix.
const INTERRUPTED: i32 = 2;

/// Whether interruptions are handled.
static IS_HANDLED: AtomicBool = AtomicBool::new(false);
/// Whether a thread ends the program.
static IS_ENDING: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Whether it is this one.
    static ENDS_HERE: Cell<bool> = const { Cell::new(false) };
}

/// Calls `interrupted` when Ctrl-C is pressed.
pub(super) fn handle(interrupted: fn(i32, Option<&str>) -> !) -> std::io::Result<()> {
    ctrlc::set_handler(move || interrupted(INTERRUPTED, None)).map_err(std::io::Error::other)?;
    IS_HANDLED.store(true, Ordering::SeqCst);
    Ok(())
}

/// Whether interruptions are handled.
pub(super) fn is_handled() -> bool {
    IS_HANDLED.load(Ordering::SeqCst)
}

/// Says that this thread ends the program. Returns once: another thread waits for the end, and this one, which failed at it, ends at once.
pub(super) fn end_here() {
    if ENDS_HERE.replace(true) {
        std::process::abort();
    }
    if IS_ENDING.swap(true, Ordering::SeqCst) {
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }
}
