//! Files that are read.
//!
//! The file type is checked before opening: a pipe without a writer would block the program.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Opens an ordinary file.
///
/// # Errors
/// When it cannot be opened, or is a folder, a pipe, a device, or `-`. The caller says which file.
pub fn open(path: &Path) -> io::Result<File> {
    if path.as_os_str() == "-" || !path.metadata()?.is_file() {
        let message = "not a regular file: save its content to a file first";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    File::open(path)
}

/// The bytes of an ordinary file.
///
/// # Errors
/// As [`open`], and when it cannot be read.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text of an ordinary file.
///
/// # Errors
/// As [`read`], and when it is no UTF-8.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    open(path)?.read_to_string(&mut text)?;
    Ok(text)
}
