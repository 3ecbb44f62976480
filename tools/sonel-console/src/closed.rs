//! Whether a program was started with a closed stdout.
//!
//! The standard library opens `/dev/null` in its place before `main`, where nobody can tell it from one that the caller chose. What runs before
//! that looks first.

use std::sync::atomic::{AtomicBool, Ordering};

static STDOUT: AtomicBool = AtomicBool::new(false);

/// Whether stdout was closed when this process began.
#[must_use]
pub fn is_stdout_closed() -> bool {
    STDOUT.load(Ordering::Relaxed)
}

/// What to say of it.
pub(crate) fn error() -> std::io::Error {
    std::io::Error::other("cannot print: stdout is closed")
}

#[cfg(all(target_os = "linux", not(sonel_portable)))]
extern "C" fn look() {
    // SAFETY: a question about a number that need not be open.
    #[allow(unsafe_code)]
    let is_closed = unsafe { libc::fcntl(libc::STDOUT_FILENO, libc::F_GETFD) } == -1;
    STDOUT.store(is_closed, Ordering::Relaxed);
}

/// The system calls what is listed here before the standard library begins.
#[cfg(all(target_os = "linux", not(sonel_portable)))]
#[allow(unsafe_code)]
#[used]
// SAFETY: a C function without arguments, which touches an atomic number alone.
#[unsafe(link_section = ".init_array")]
static LOOK: extern "C" fn() = look;
