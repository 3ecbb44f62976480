//! Outputs that appear under their name only when complete.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use tempfile::NamedTempFile;

/// What the name of a file ends with until it is complete.
pub const UNFINISHED: &str = ".unfinished";

/// A file being written beside its final place, under a name that says for what and ends with [`UNFINISHED`]. Dropped
/// without [`Output::publish`], it leaves no trace; a process that is killed leaves that file.
#[derive(Debug)]
pub struct Output {
    target: PathBuf,
    file: BufWriter<NamedTempFile>,
}

impl Output {
    /// Begins an output that will be `target`.
    ///
    /// # Errors
    /// When `target` is a directory or anything else that is no ordinary file, or its folder cannot be written.
    pub fn create(target: &Path) -> anyhow::Result<Self> {
        if target.exists() && !target.is_file() {
            bail!("{} is not an ordinary file: choose another output", target.display());
        }
        let folder = match target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            bail!("the folder {} does not exist: create it first", folder.display());
        }
        let mut prefix = target.file_name().unwrap_or_default().to_owned();
        prefix.push(".");
        let file =
            tempfile::Builder::new().prefix(&prefix).suffix(UNFINISHED).tempfile_in(folder).with_context(
                || format!("cannot write in {}: choose another folder for it", folder.display()),
            )?;
        Ok(Self { target: target.to_owned(), file: BufWriter::with_capacity(1 << 20, file) })
    }

    /// Where it will be.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// What to write to.
    pub fn writer(&mut self) -> &mut BufWriter<NamedTempFile> {
        &mut self.file
    }

    /// The file as written so far, to be read before it is published.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn file(&mut self) -> std::io::Result<&File> {
        self.file.flush()?;
        Ok(self.file.get_ref().as_file())
    }

    /// Puts the complete file in its place, replacing an older one in a single step.
    ///
    /// # Errors
    /// When the disk is full or the file cannot be renamed; an older file then stays as it was.
    pub fn publish(mut self) -> anyhow::Result<()> {
        let failed = || format!("cannot write {}; an older file there is untouched", self.target.display());
        self.file.flush().with_context(failed)?;
        let file =
            self.file.into_inner().map_err(std::io::IntoInnerError::into_error).with_context(|| {
                format!("cannot write {}; an older file there is untouched", self.target.display())
            })?;
        let permissions = readable_by_all(file.as_file());
        file.as_file().sync_all()?;
        if let Some(permissions) = permissions {
            file.as_file().set_permissions(permissions)?;
        }
        file.persist(&self.target).map_err(|error| {
            anyhow::Error::new(error.error).context(format!("cannot rename to {}", self.target.display()))
        })?;
        Ok(())
    }
}

/// Temporary files are private to their owner; an output has the permissions a new file would have.
#[cfg(unix)]
fn readable_by_all(file: &File) -> Option<std::fs::Permissions> {
    use std::os::unix::fs::PermissionsExt;
    let mut permissions = file.metadata().ok()?.permissions();
    permissions.set_mode(0o644);
    Some(permissions)
}

#[cfg(not(unix))]
fn readable_by_all(_: &File) -> Option<std::fs::Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unfinished_output_leaves_the_old_file_alone() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("hall.sonelmap");
        std::fs::write(&target, "old").unwrap();
        let mut output = Output::create(&target).unwrap();
        output.writer().write_all(b"new, but never finished").unwrap();
        let names = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        let names: Vec<String> = names.map(|name| name.to_string_lossy().into_owned()).collect();
        assert!(names.iter().any(|name| name.starts_with("hall.sonelmap.") && name.ends_with(UNFINISHED)));
        drop(output);
        assert_eq!(std::fs::read_to_string(&target).unwrap(), "old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_published_output_replaces_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("hall.sonelmap");
        std::fs::write(&target, "old").unwrap();
        let mut output = Output::create(&target).unwrap();
        output.writer().write_all(b"new").unwrap();
        output.publish().unwrap();
        assert_eq!(std::fs::read_to_string(&target).unwrap(), "new");
    }

    #[test]
    fn folders_and_missing_folders_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = Output::create(folder.path()).unwrap_err();
        assert!(error.to_string().contains("not an ordinary file"));
        let error = Output::create(&folder.path().join("nowhere/a.npz")).unwrap_err();
        assert!(error.to_string().contains("does not exist"));
    }
}
