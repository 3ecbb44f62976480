//! Files: inputs are regular files, outputs appear when they are complete.

use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::path::Path;

use crate::{Error, Result};

/// Largest file that is read as a whole, and largest text [bytes]: what a parser makes of a text takes up to fifty times as much memory.
const LARGEST: u64 = 2 << 30;
const LARGEST_TEXT: u64 = 8 << 20;

fn refused<T>(kind: io::ErrorKind, message: impl Into<String>) -> io::Result<T> {
    Err(io::Error::new(kind, message.into()))
}

/// Opens a regular file: a pipe without a writer would block.
///
/// # Errors
/// When it cannot be opened, or is a folder, a pipe, a device, or `-`.
pub fn open(path: &Path) -> io::Result<File> {
    let is_odd = |name: char| name.is_control() || (name == '\\' && !cfg!(windows));
    match path.metadata() {
        Err(error) if error.kind() == io::ErrorKind::NotFound && path.to_string_lossy().contains(is_odd) => {
            refused(
                error.kind(),
                "no such file: write / between folders; \\ begins an escape in a text in \"…\"",
            )
        }
        Err(error) => Err(error),
        Ok(metadata) if metadata.is_file() && path.as_os_str() != "-" => File::open(path),
        Ok(_) => refused(io::ErrorKind::InvalidInput, "not a regular file: save its content to a file first"),
    }
}

/// The bytes of a regular file.
///
/// # Errors
/// The errors of [`open`]; a file that cannot be read, is larger than 2 GiB, or text in UTF-16.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    read_at_most(path, LARGEST)
}

fn read_at_most(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let (file, mut bytes) = (open(path)?, Vec::new());
    if file.metadata()?.len() > most || file.take(most + 1).read_to_end(&mut bytes)? as u64 > most {
        let most = most >> 20;
        return refused(
            io::ErrorKind::FileTooLarge,
            format!("larger than {most} MiB: is it the right file?"),
        );
    }
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return refused(io::ErrorKind::InvalidData, "text in UTF-16: save it as UTF-8");
    }
    Ok(bytes)
}

/// The bytes of the file `path` in `folder`. No link leads out of what is before `/./` in the path.
///
/// # Errors
/// The errors of [`read`], and a file elsewhere.
pub fn read_in(folder: &Path, path: &str) -> io::Result<Vec<u8>> {
    let place = folder.join(path);
    if let Some((within, _)) = path.rsplit_once("/./")
        && !place.canonicalize()?.starts_with(folder.join(within).canonicalize()?)
    {
        return refused(io::ErrorKind::InvalidInput, "a link to another folder: put the file itself there");
    }
    read(&place)
}

/// The text of a regular file.
///
/// # Errors
/// The errors of [`read`], and a file that is larger than 8 MiB or no UTF-8.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    let bytes = read_at_most(path, LARGEST_TEXT)?;
    let good = match std::str::from_utf8(&bytes) {
        Ok(text) => text.find('\0').unwrap_or(text.len()),
        Err(error) => error.valid_up_to(),
    };
    if good < bytes.len() {
        let line = 1 + bytes[..good].iter().filter(|byte| **byte == b'\n').count();
        let perhaps = if bytes[good] == 0 { "UTF-16" } else { "Latin-1" };
        let message = format!("line {line} is no text in UTF-8 (but perhaps in {perhaps}): save it as UTF-8");
        return refused(io::ErrorKind::InvalidData, message);
    }
    let text = String::from_utf8(bytes).expect("all of it was checked");
    Ok(text.trim_start_matches('\u{feff}').to_owned())
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

#[cfg(test)]
mod tests {
    use super::*;

    fn said<T>(result: io::Result<T>) -> String {
        result.err().map(|error| error.to_string()).unwrap_or_default()
    }

    #[test]
    fn what_is_no_text_is_said_with_its_line_and_the_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        let of = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            read_to_string(&path)
        };
        assert_eq!(of("\u{feff}α = 1".as_bytes()).unwrap(), "α = 1");
        assert!(said(of(b"a = 1\nb = \"W\xe4nde\"\n")).starts_with("line 2 is no text in UTF-8"));
        assert!(said(of(b"a\0 = 1")).contains("perhaps in UTF-16"));
        for utf_16 in [&b"\xff\xfea\0"[..], b"\xfe\xff\0a"] {
            assert!(said(of(utf_16)).contains("UTF-16: save it as UTF-8"));
        }
        assert_eq!(of(&vec![b'\n'; LARGEST_TEXT as usize]).unwrap().len() as u64, LARGEST_TEXT);
        assert!(said(of(&vec![b'\n'; LARGEST_TEXT as usize + 1])).starts_with("larger than 8 MiB"));
    }

    #[test]
    fn a_folder_and_a_path_of_windows_are_told_with_a_remedy() {
        let folder = tempfile::tempdir().unwrap();
        assert!(said(read(folder.path())).contains("not a regular file"));
        for name in ["models\\room.obj", "models\room.obj"] {
            assert!(said(read(&folder.path().join(name))).contains("write / between folders"), "{name}");
        }
        assert!(!said(read(&folder.path().join("none.obj"))).contains("escape"));
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_out_of_no_folder_that_a_path_states() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(path("models/parts")).unwrap();
        for name in ["secret", "models/a.bin", "models/parts/b.bin"] {
            std::fs::write(path(name), name).unwrap();
        }
        symlink(path("secret"), path("models/out.bin")).unwrap();
        symlink(path("models/parts"), path("models/down")).unwrap();
        let read = |name: &str| read_in(folder.path(), name);
        for name in ["models/./a.bin", "models/./down/b.bin", "models/out.bin", "././secret"] {
            assert!(read(name).is_ok(), "{name}");
        }
        assert!(said(read("models/./out.bin")).contains("a link to another folder"));
        assert!(said(read("models/./../secret")).contains("a link to another folder"));
    }
}
