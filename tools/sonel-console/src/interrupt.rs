//! Files that are removed when the program is interrupted (Ctrl-C, `kill`).
//!
//! Where there are no such signals the files stay, and the next run with the same output removes them.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Whether an interruption is how the program ends.
static IS_THE_END: AtomicBool = AtomicBool::new(false);

/// From now on an interruption is no failure: a server runs until then.
pub fn is_the_end() {
    IS_THE_END.store(true, Ordering::Relaxed);
}

/// Files to remove.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
/// How many files have got their names.
static PUBLISHED: AtomicUsize = AtomicUsize::new(0);

/// A file that an interruption removes, as long as the value lives.
#[derive(Debug)]
pub(crate) struct Unfinished(PathBuf);

impl Unfinished {
    /// For the file that `make` makes: an interruption finds none, or removes it.
    pub(crate) fn begin<T: AsRef<Path>, E>(make: impl FnOnce() -> Result<T, E>) -> Result<(T, Self), E> {
        let mut files = files();
        let made = make()?;
        // Whatever becomes the working directory later.
        let path = std::path::absolute(&made).unwrap_or_else(|_| made.as_ref().to_owned());
        files.push(path.clone());
        Ok((made, Self(path)))
    }
}

/// Calls `rename` for each of some files, which gives it its own name, until it fails: all in one step as seen from an interruption. What is
/// left of it is dropped after that step.
pub(crate) fn publish<T, E>(
    all: impl IntoIterator<Item = (Unfinished, T)>,
    rename: impl Fn(T) -> Result<(), E>,
) -> Result<(), E> {
    let mut left = Vec::new();
    let mut result = Ok(());
    {
        let mut files = files();
        for (unfinished, file) in all {
            if result.is_ok() {
                result = rename(file);
            }
            if result.is_ok() {
                files.retain(|path| *path != unfinished.0);
                PUBLISHED.fetch_add(1, Ordering::SeqCst);
            }
            left.push(unfinished);
        }
    }
    drop(left);
    result
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
    failure::report();
    let mut signals = signal_hook::iterator::Signals::new(TERM_SIGNALS.iter().chain([&SIGHUP]))?;
    let wait = move || {
        failure::wait_here();
        if let Some(signal) = signals.forever().next() {
            match (failure::found(), PUBLISHED.load(Ordering::SeqCst)) {
                (Some(failure), _) => end(format_args!("{failure}"), 2),
                (None, _) if IS_THE_END.load(Ordering::Relaxed) => end(format_args!("ended"), 0),
                (None, 0) => end(format_args!("interrupted; older outputs are untouched"), 128 + signal),
                (None, some) => {
                    let text =
                        format_args!("interrupted after {some} complete outputs; others are untouched");
                    end(text, 128 + signal);
                }
            }
        }
    };
    std::thread::Builder::new().spawn(wait).map(drop)
}

/// Removes unfinished files and ends the program; one of several threads does.
#[cfg(unix)]
fn end(message: std::fmt::Arguments<'_>, code: i32) -> ! {
    use std::io::{IsTerminal, Write};
    failure::end_here();
    // Held to the end, so that no file is begun or finished meanwhile. Who holds it may wait for ever: then files stay, and the next run removes them.
    let files = (0..ATTEMPTS).find_map(|_| UNFINISHED.try_lock().ok().or_else(pause));
    for file in files.iter().flat_map(|files| files.iter()) {
        let _ = std::fs::remove_file(file);
    }
    let mut log = std::io::stderr();
    // Below the progress bar.
    let line = if log.is_terminal() { "\n" } else { "" };
    let begin = if code == 0 { "" } else { "error: " };
    let _ = writeln!(log, "{line}{begin}{message}");
    std::process::exit(code)
}

/// Attempts to get the list of files, in hundredths of a second.
#[cfg(unix)]
const ATTEMPTS: usize = 100;

#[cfg(unix)]
fn pause<T>() -> Option<T> {
    std::thread::sleep(std::time::Duration::from_millis(10));
    None
}

/// Ends the program because so many `bytes` of memory were refused; returns where it handles no interruptions.
pub(crate) fn out_of_memory(bytes: usize) {
    #[cfg(unix)]
    if failure::is_reported() {
        end(format_args!("not enough memory ({bytes} bytes more): {}", failure::LESS), 2);
    }
    #[cfg(not(unix))]
    let _ = bytes;
}

/// Failures that the system tells by a signal in the thread that failed. What the thread was about to do cannot be done: it stays in the
/// handler, and the thread that waits for interruptions ends the program.
#[cfg(unix)]
mod failure {
    use std::cell::Cell;
    use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
    use std::time::Duration;

    /// The signal of the first failure.
    static SIGNAL: AtomicI32 = AtomicI32::new(0);
    /// Whether failures are reported.
    static IS_REPORTED: AtomicBool = AtomicBool::new(false);
    /// Whether a thread waits for interruptions.
    static IS_AWAITED: AtomicBool = AtomicBool::new(false);
    /// Whether a thread ends the program.
    static IS_ENDING: AtomicBool = AtomicBool::new(false);

    thread_local! {
        /// Whether it is this one.
        static ENDS_HERE: Cell<bool> = const { Cell::new(false) };
    }

    /// What to do where memory is short.
    pub const LESS: &str = "take fewer --threads or a wider --bin, divide the run or its receivers (--shard), or allow more memory (ulimit -v)";

    /// What failed, and what to do.
    pub fn found() -> Option<String> {
        match SIGNAL.load(Ordering::SeqCst) {
            libc::SIGBUS => Some(
                "an input was truncated or became unreadable (bus error): do not change it during the run, check the disk, and run the command again"
                    .to_owned(),
            ),
            libc::SIGABRT => Some(format!("the program was aborted; if memory is short, {LESS}")),
            _ => None,
        }
    }

    /// Says that this thread waits for interruptions.
    pub fn wait_here() {
        IS_AWAITED.store(true, Ordering::SeqCst);
    }

    /// Says that this thread ends the program. Returns once: another thread waits for the end, and this one, which failed at it, ends at once.
    pub fn end_here() {
        if ENDS_HERE.replace(true) {
            signal_hook::low_level::exit(2);
        }
        if IS_ENDING.swap(true, Ordering::SeqCst) {
            stay();
        }
    }

    fn stay() -> ! {
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }

    extern "C" fn fail(signal: libc::c_int) {
        if ENDS_HERE.get() || !IS_AWAITED.load(Ordering::SeqCst) {
            let _ = std::io::Write::write_all(&mut std::io::stderr(), b"error: not enough memory\n");
            signal_hook::low_level::exit(2);
        }
        let _ = SIGNAL.compare_exchange(0, signal, Ordering::SeqCst, Ordering::SeqCst);
        // Allowed in a handler: an atomic, kill and sleep.
        let _ = signal_hook::low_level::raise(libc::SIGTERM);
        stay();
    }

    /// Whether failures are reported.
    pub fn is_reported() -> bool {
        IS_REPORTED.load(Ordering::SeqCst)
    }

    /// From now on failures are reported.
    pub fn report() {
        IS_REPORTED.store(true, Ordering::SeqCst);
        for signal in [libc::SIGBUS, libc::SIGABRT] {
            // SAFETY: the handler calls only what POSIX allows in one, and never returns to the code that failed.
            #[allow(unsafe_code)]
            unsafe {
                libc::signal(signal, fail as extern "C" fn(libc::c_int) as libc::sighandler_t);
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
