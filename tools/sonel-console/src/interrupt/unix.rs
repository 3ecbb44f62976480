//! Interruptions as signals, and failures that the system tells by a signal in the thread that failed. What that thread was about to do cannot be
//! done: it stays in the handler, and the thread that waits for interruptions ends the program.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};

use signal_hook::consts::{SIGHUP, TERM_SIGNALS};

use super::{ENDS_HERE, stay};

/// Calls `interrupted` with the number of the first signal, or with what failed.
pub(super) fn handle(interrupted: fn(i32, Option<&str>) -> !) -> std::io::Result<()> {
    report();
    let mut signals = signal_hook::iterator::Signals::new(TERM_SIGNALS.iter().chain([&SIGHUP]))?;
    let wait = move || {
        WAITS_HERE.set(true);
        IS_AWAITED.store(true, Ordering::SeqCst);
        if let Some(signal) = signals.forever().next() {
            interrupted(signal, found());
        }
    };
    std::thread::Builder::new().spawn(wait).map(drop)
}

/// The signal of the first failure.
static SIGNAL: AtomicI32 = AtomicI32::new(0);
/// Whether a thread waits for interruptions.
static IS_AWAITED: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Whether this is the thread that waits.
    static WAITS_HERE: Cell<bool> = const { Cell::new(false) };
}

/// What failed, and what to do. It takes no memory, because there may be none; that is said below what other threads are just writing.
fn found() -> Option<&'static str> {
    match SIGNAL.load(Ordering::SeqCst) {
        libc::SIGBUS => Some(
            "error: an input was truncated or became unreadable (bus error): do not change it during the run, check the disk, and run the command again",
        ),
        libc::SIGABRT => Some(
            "\nerror: the program was aborted; if memory is short, take fewer --threads or a wider --bin, divide the run or its receivers (--shard), or allow more memory (ulimit -v)",
        ),
        _ => None,
    }
}

/// Ends the program, which failed at its end.
pub(super) fn fail() -> ! {
    signal_hook::low_level::exit(2)
}

extern "C" fn failed(signal: libc::c_int) {
    // The thread that waits cannot wait for itself.
    if WAITS_HERE.get() || ENDS_HERE.get() || !IS_AWAITED.load(Ordering::SeqCst) {
        let _ = std::io::Write::write_all(&mut std::io::stderr(), b"error: not enough memory\n");
        fail();
    }
    let _ = SIGNAL.compare_exchange(0, signal, Ordering::SeqCst, Ordering::SeqCst);
    // Allowed in a handler: an atomic, kill and sleep.
    let _ = signal_hook::low_level::raise(libc::SIGTERM);
    stay();
}

/// From now on failures are reported.
fn report() {
    for signal in [libc::SIGBUS, libc::SIGABRT] {
        // SAFETY: the handler calls only what POSIX allows in one, and never returns to the code that failed.
        #[allow(unsafe_code)]
        unsafe {
            libc::signal(signal, failed as extern "C" fn(libc::c_int) as libc::sighandler_t);
        }
    }
}
