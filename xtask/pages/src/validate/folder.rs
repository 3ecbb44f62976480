//! A folder with data sets of others. A file is found by the end of its path, wherever its archive was unpacked.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

/// What lies in a folder and below.
pub(super) struct Folder {
    root: PathBuf,
    files: Vec<PathBuf>,
}

impl Folder {
    /// Lists the files.
    pub(super) fn open(root: &Path) -> Result<Self> {
        let root = root.to_owned();
        ensure!(
            root.is_dir(),
            "there is no folder {}: docs/validation.md says which data sets it has to hold and where they are",
            root.display()
        );
        let mut files = Vec::new();
        list(&root, &mut files).with_context(|| format!("cannot list {}", root.display()))?;
        files.sort();
        Ok(Self { root, files })
    }

    /// The text of the file whose path ends with `tail`; `origin` says where it comes from.
    pub(super) fn text(&self, tail: &str, origin: &str) -> Result<String> {
        let path = self.files.iter().find(|path| path.ends_with(tail));
        let path = path.with_context(|| {
            format!(
                "{} has no file {tail}, there or in a folder below. It comes from {origin}",
                self.root.display()
            )
        })?;
        let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}

fn list(folder: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            list(&entry.path(), files)?;
        } else {
            files.push(entry.path());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_found_below_and_a_missing_one_is_named_with_its_origin() {
        let root = std::env::temp_dir().join(format!("sonel-validate-{}", std::process::id()));
        assert!(Folder::open(&root).err().unwrap().to_string().contains("docs/validation.md"));
        fs::create_dir_all(root.join("3 Surfaces/fitted")).unwrap();
        fs::write(root.join("3 Surfaces/fitted/floor.csv"), "1, 2").unwrap();
        let folder = Folder::open(&root).unwrap();
        assert_eq!(folder.text("fitted/floor.csv", "").unwrap(), "1, 2");
        let message = folder.text("initial/floor.csv", "the attic").unwrap_err().to_string();
        assert!(message.contains("initial/floor.csv") && message.contains("the attic"), "{message}");
        fs::remove_dir_all(root).unwrap();
    }
}
