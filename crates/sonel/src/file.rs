//! Files: inputs are regular files, outputs appear when they are complete.

use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::path::Path;

use crate::{Error, Result};

/// Opens a regular file: a pipe without a writer would block.
///
/// # Errors
/// When it cannot be opened, or is a folder, a pipe, a device, or `-`.
pub fn open(path: &Path) -> io::Result<File> {
    if path.as_os_str() == "-" || !path.metadata()?.is_file() {
        let message = "not a regular file: save its content to a file first";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    File::open(path)
}

/// The bytes of a regular file.
///
/// # Errors
/// The errors of [`open`], and when the file cannot be read.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text of a regular file.
///
/// # Errors
/// The errors of [`read`], and when the file is no UTF-8.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    open(path)?.read_to_string(&mut text)?;
    Ok(text)
}

/// Files that have the permissions of a new file: temporary ones are private to their owner.
#[cfg(unix)]
fn temporary() -> tempfile::Builder<'static, 'static> {
    use std::os::unix::fs::PermissionsExt;
    let mut builder = tempfile::Builder::new();
    builder.permissions(std::fs::Permissions::from_mode(0o666));
    builder
}

#[cfg(not(unix))]
fn temporary() -> tempfile::Builder<'static, 'static> {
    tempfile::Builder::new()
}

/// Writes `content` to a file beside `path` and puts it in its place.
pub(crate) fn write(path: &Path, content: impl FnOnce(&mut BufWriter<File>) -> Result<()>) -> Result<()> {
    let failed = |error: Error| Error::At {
        place: format!("cannot write {}; an older file there is untouched", path.display()),
        cause: Box::new(error),
    };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let written = || -> Result<()> {
        let (file, place) = temporary().tempfile_in(folder)?.into_parts();
        let mut out = BufWriter::new(file);
        content(&mut out)?;
        out.flush()?;
        place.persist(path).map_err(|error| Error::File(error.error))
    };
    written().map_err(failed)
}
