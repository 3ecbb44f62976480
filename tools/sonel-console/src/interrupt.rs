//! Files that are removed when the program is interrupted (Ctrl-C, `kill`).
//!
//! Where there are no such signals the files stay, and the next run with the same output removes them.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

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

/// From now on an interruption removes unfinished files, says so and ends the program with 128 plus the number of the signal.
///
/// # Errors
/// When the system refuses.
#[cfg(unix)]
pub fn remove_unfinished_files() -> std::io::Result<()> {
    use std::io::Write;
    let mut signals = signal_hook::iterator::Signals::new(signal_hook::consts::TERM_SIGNALS)?;
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            // Held to the end, so that no file is begun or finished meanwhile.
            let files = files();
            for file in files.iter() {
                let _ = std::fs::remove_file(file);
            }
            let _ = writeln!(std::io::stderr(), "\nerror: interrupted; older outputs are untouched");
            std::process::exit(128 + signal);
        }
    });
    Ok(())
}

/// Does nothing here.
///
/// # Errors
/// None.
#[cfg(not(unix))]
pub fn remove_unfinished_files() -> std::io::Result<()> {
    Ok(())
}
