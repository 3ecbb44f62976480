//! Files that are removed when the program is interrupted (Ctrl-C, `kill`).
//!
//! Where there are no such signals the files stay, and the next run with the same output removes them.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Whether an interruption is how the program ends.
static IS_THE_END: AtomicBool = AtomicBool::new(false);

/// From now on an interruption is no failure: a server runs until then.
pub fn is_the_end() {
    IS_THE_END.store(true, Ordering::Relaxed);
}

/// Files to remove.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file that an interruption removes, as long as the value lives.
#[derive(Debug)]
pub(crate) struct Unfinished(PathBuf);

impl Unfinished {
    /// For the file at `path`.
    pub(crate) fn new(path: &Path) -> Self {
        // Whatever becomes the working directory later.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        files().push(path.clone());
        Self(path)
    }

    /// Calls `rename`, which gives the file its own name, in one step as seen from an interruption.
    pub(crate) fn done<T>(self, rename: impl FnOnce() -> T) -> T {
        let mut files = files();
        let result = rename();
        files.retain(|file| *file != self.0);
        drop(files);
        result
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        files().retain(|file| *file != self.0);
    }
}

fn files() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on an interruption removes unfinished files, says so and ends the program with 128 plus the number of the signal; so does the
/// end of the terminal. A mapped file that is cut off while it is read, and memory that is not there, end it with code 2.
///
/// # Errors
/// When the system refuses.
#[cfg(unix)]
pub fn remove_unfinished_files() -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, TERM_SIGNALS};
    let mut signals = signal_hook::iterator::Signals::new(TERM_SIGNALS.iter().chain([&SIGHUP]))?;
    failure::report();
    let wait = move || {
        if let Some(signal) = signals.forever().next() {
            let (message, code) = match failure::found() {
                Some(message) => (message, 2),
                None if IS_THE_END.load(Ordering::Relaxed) => ("ended", 0),
                None => ("interrupted; older outputs are untouched", 128 + signal),
            };
            end(message, code);
        }
    };
    std::thread::Builder::new().spawn(wait).map(drop)
}

/// Removes unfinished files and ends the program.
#[cfg(unix)]
fn end(message: &str, code: i32) -> ! {
    use std::io::{IsTerminal, Write};
    // Held to the end, so that no file is begun or finished meanwhile.
    let files = files();
    for file in files.iter() {
        let _ = std::fs::remove_file(file);
    }
    let mut log = std::io::stderr();
    // Below the progress bar.
    let line = if log.is_terminal() { "\n" } else { "" };
    let begin = if code == 0 { "" } else { "error: " };
    let _ = writeln!(log, "{line}{begin}{message}");
    std::process::exit(code)
}

/// Failures that the system tells by a signal in the thread that failed. What the thread was about to do cannot be done: it stays in the
/// handler, and the thread that waits for interruptions ends the program.
#[cfg(unix)]
mod failure {
    use std::sync::atomic::{AtomicI32, Ordering};
    use std::time::Duration;

    /// The signal of the first failure.
    static SIGNAL: AtomicI32 = AtomicI32::new(0);

    /// What failed.
    pub fn found() -> Option<&'static str> {
        match SIGNAL.load(Ordering::SeqCst) {
            libc::SIGBUS => Some(
                "an input was truncated or became unreadable (bus error): do not change it during the run, check the disk, and run the command again",
            ),
            libc::SIGABRT => Some(
                "the program was aborted; if memory is short, take fewer --threads or a wider --bin, or divide the run or its receivers (--shard)",
            ),
            _ => None,
        }
    }

    extern "C" fn stay(signal: libc::c_int) {
        SIGNAL.store(signal, Ordering::SeqCst);
        // Allowed in a handler: an atomic, kill and sleep.
        let _ = signal_hook::low_level::raise(libc::SIGTERM);
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }

    /// From now on such failures are reported.
    pub fn report() {
        for signal in [libc::SIGBUS, libc::SIGABRT] {
            // SAFETY: the handler calls only what POSIX allows in one, and never returns to the code that failed.
            #[allow(unsafe_code)]
            unsafe {
                libc::signal(signal, stay as extern "C" fn(libc::c_int) as libc::sighandler_t);
            }
        }
    }
}

/// Does nothing here.
///
/// # Errors
/// None.
#[cfg(not(unix))]
pub fn remove_unfinished_files() -> std::io::Result<()> {
    Ok(())
}
