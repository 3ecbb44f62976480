//! A panic that ends a program is one message; one that is caught, as in readers of foreign formats, is none.

use std::io::Write;
use std::panic::PanicHookInfo;
use std::sync::{Mutex, PoisonError};

/// The last panic.
static LAST: Mutex<String> = Mutex::new(String::new());

/// From now on panics are noted; where the user asks for backtraces (`RUST_BACKTRACE`) they are printed as usual.
pub(crate) fn note_panics() {
    if std::env::var_os("RUST_BACKTRACE").is_none_or(|value| value == "0") {
        std::panic::set_hook(Box::new(|panic: &PanicHookInfo<'_>| {
            *LAST.lock().unwrap_or_else(PoisonError::into_inner) = panic.to_string().replace('\n', " ");
        }));
    }
}

/// Says that the program failed.
pub(crate) fn tell() {
    let last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    let what = if last.is_empty() { "see above" } else { last.as_str() };
    // A closed stderr cannot be told.
    let _ = writeln!(
        std::io::stderr(),
        "error: a defect of the program, please report it with the command: {what}"
    );
}
