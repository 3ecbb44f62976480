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
    let mut signals = signal_hook::iterator::Signals::new(TERM_SIGNALS.iter().chain([&SIGHUP]))?;
    let wait = move || {
        failure::waits_here();
        if let Some(signal) = signals.forever().next() {
            match failure::found() {
                Some(failure::Failure { what, remedy, bytes: 0 }) => end(format_args!("{what}: {remedy}"), 2),
                Some(failure::Failure { what, remedy, bytes }) => {
                    end(format_args!("{what} ({bytes} bytes more): {remedy}"), 2)
                }
                None if IS_THE_END.load(Ordering::Relaxed) => end(format_args!("ended"), 0),
                None => match PUBLISHED.load(Ordering::SeqCst) {
                    0 => end(format_args!("interrupted; older outputs are untouched"), 128 + signal),
                    some => end(
                        format_args!("interrupted after {some} complete outputs; others are untouched"),
                        128 + signal,
                    ),
                },
            }
        }
    };
    std::thread::Builder::new().spawn(wait)?;
    failure::report();
    Ok(())
}

/// Removes unfinished files and ends the program.
#[cfg(unix)]
fn end(message: std::fmt::Arguments<'_>, code: i32) -> ! {
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
    use std::cell::Cell;
    use std::sync::atomic::{AtomicBool, AtomicI32, AtomicUsize, Ordering};
    use std::time::Duration;

    /// The signal of the first failure, or [`MEMORY`].
    static FIRST: AtomicI32 = AtomicI32::new(0);
    /// No signal: memory was refused.
    const MEMORY: i32 = -1;
    /// How much of it [bytes].
    static BYTES: AtomicUsize = AtomicUsize::new(0);
    /// Whether failures are reported.
    static IS_ON: AtomicBool = AtomicBool::new(false);

    thread_local! {
        /// Whether this is the thread that ends the program.
        static IS_WAITING: Cell<bool> = const { Cell::new(false) };
    }

    /// What failed.
    pub struct Failure {
        pub what: &'static str,
        pub remedy: &'static str,
        /// Memory that was refused; 0 where that is not known.
        pub bytes: usize,
    }

    /// The first failure.
    pub fn found() -> Option<Failure> {
        const LESS: &str = "take fewer --threads or a wider --bin, divide the run or its receivers (--shard), or allow more memory (ulimit -v)";
        let (what, remedy, bytes) = match FIRST.load(Ordering::SeqCst) {
            MEMORY => ("not enough memory", LESS, BYTES.load(Ordering::SeqCst)),
            libc::SIGBUS => (
                "an input was truncated or became unreadable (bus error)",
                "do not change it during the run, check the disk, and run the command again",
                0,
            ),
            libc::SIGABRT => ("the program was aborted; if memory is short", LESS, 0),
            _ => return None,
        };
        Some(Failure { what, remedy, bytes })
    }

    /// Says that this thread ends the program.
    pub fn waits_here() {
        IS_WAITING.set(true);
    }

    /// Has the program ended by the thread that waits, where failures are reported; by nobody else.
    pub fn out_of_memory(bytes: usize) {
        if IS_ON.load(Ordering::SeqCst) {
            BYTES.store(bytes, Ordering::SeqCst);
            stay(MEMORY);
        }
    }

    extern "C" fn stay(failure: libc::c_int) {
        if IS_WAITING.get() {
            signal_hook::low_level::exit(2);
        }
        let _ = FIRST.compare_exchange(0, failure, Ordering::SeqCst, Ordering::SeqCst);
        // Allowed in a handler: an atomic, kill and sleep.
        let _ = signal_hook::low_level::raise(libc::SIGTERM);
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }

    /// From now on such failures are reported.
    pub fn report() {
        IS_ON.store(true, Ordering::SeqCst);
        for signal in [libc::SIGBUS, libc::SIGABRT] {
            // SAFETY: the handler calls only what POSIX allows in one, and never returns to the code that failed.
            #[allow(unsafe_code)]
            unsafe {
                libc::signal(signal, stay as extern "C" fn(libc::c_int) as libc::sighandler_t);
            }
        }
    }
}

/// Has the program ended because so many `bytes` of memory were refused. Returns where nobody waits for failures.
pub(crate) fn out_of_memory(bytes: usize) {
    #[cfg(unix)]
    failure::out_of_memory(bytes);
    #[cfg(not(unix))]
    let _ = bytes;
}

/// Does nothing here.
///
/// # Errors
/// None.
#[cfg(not(unix))]
pub fn remove_unfinished_files() -> std::io::Result<()> {
    Ok(())
}
