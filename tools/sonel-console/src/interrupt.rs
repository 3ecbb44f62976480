//! Files that are removed when the program is interrupted (Ctrl-C, `kill`).
//!
//! `unix` knows of interruptions by signals, and of failures that the system tells by one; `portable` has Ctrl-C and the end of the console alone.
//! `RUSTFLAGS="--cfg sonel_portable"` takes it on Unix, too, where it is tested. Files that stay are removed by the next run with the same output.

#[cfg(any(not(unix), sonel_portable))]
mod portable;
#[cfg(all(unix, not(sonel_portable)))]
mod unix;

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

#[cfg(any(not(unix), sonel_portable))]
use portable as system;
#[cfg(all(unix, not(sonel_portable)))]
use unix as system;

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
pub fn remove_unfinished_files() -> std::io::Result<()> {
    system::handle(interrupted)
}

/// Ends the program after a signal, or after what `failure` says.
fn interrupted(signal: i32, failure: Option<&str>) -> ! {
    match (failure, PUBLISHED.load(Ordering::SeqCst)) {
        (Some(failure), _) => end(format_args!("{failure}"), 2),
        (None, _) if IS_THE_END.load(Ordering::Relaxed) => end(format_args!("ended"), 0),
        (None, 0) => end(format_args!("interrupted; older outputs are untouched"), 128 + signal),
        (None, some) => {
            end(format_args!("interrupted after {some} complete outputs; others are untouched"), 128 + signal)
        }
    }
}

/// Whether a thread ends the program.
static IS_ENDING: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Whether it is this one.
    static ENDS_HERE: Cell<bool> = const { Cell::new(false) };
}

/// Says that this thread ends the program. Returns once: another thread waits for the end, and this one, which failed at it, ends at once.
fn end_here() {
    if ENDS_HERE.replace(true) {
        system::fail();
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

/// Removes unfinished files and ends the program; one of several threads does.
fn end(message: std::fmt::Arguments<'_>, code: i32) -> ! {
    use std::io::{IsTerminal, Write};
    end_here();
    // Held to the end, so that no file is begun or finished meanwhile. Who holds it may wait for ever: then files stay, and the next run removes them.
    let files = (0..ATTEMPTS).find_map(|_| UNFINISHED.try_lock().ok().or_else(pause));
    for file in files.iter().flat_map(|files| files.iter()) {
        let _ = std::fs::remove_file(file);
    }
    let mut log = std::io::stderr();
    // Below the progress bar.
    let line = if log.is_terminal() { "\n" } else { "" };
    // A failure begins its own line.
    let begin = if matches!(code, 0 | 2) { "" } else { "error: " };
    // In one piece: other threads may be writing that they failed, too, and there may be no memory.
    let mut text = std::io::Cursor::new([0; 512]);
    let _ = writeln!(text, "{line}{begin}{message}");
    let _ = log.write_all(&text.get_ref()[..text.position() as usize]);
    std::process::exit(code)
}

/// Attempts to get the list of files, in hundredths of a second.
const ATTEMPTS: usize = 100;

fn pause<T>() -> Option<T> {
    std::thread::sleep(Duration::from_millis(10));
    None
}
