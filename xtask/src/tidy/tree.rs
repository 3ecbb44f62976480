//! The files of the project as the rules see them.

use std::fmt;
use std::fs;

use anyhow::{Context, Result, ensure};

use xtask::workspace;

/// One text file.
pub(crate) struct SourceFile {
    /// Path from the root, with slashes.
    pub path: String,
    pub text: String,
}

impl SourceFile {
    pub(crate) fn is_rust(&self) -> bool {
        self.path.ends_with(".rs")
    }

    pub(crate) fn is_markdown(&self) -> bool {
        self.path.ends_with(".md")
    }

    /// Rust that ships in a library: `crates/*/src`, without the crate that only tests use.
    pub(crate) fn is_library(&self) -> bool {
        self.is_rust()
            && self.path.starts_with("crates/")
            && self.path.contains("/src/")
            && !self.path.starts_with("crates/sonel-testkit/")
    }

    /// A finding in this file; `line` counts from 1.
    pub(crate) fn finding(&self, line: usize, message: impl Into<String>) -> Finding {
        Finding { path: self.path.clone(), line, message: message.into() }
    }
}

/// All files that are or would be under version control.
#[derive(Default)]
pub(crate) struct Tree {
    pub files: Vec<SourceFile>,
    /// Paths of all files, also those that are no text.
    pub paths: Vec<String>,
}

impl Tree {
    /// The working tree: tracked and new files, without what git ignores.
    pub(crate) fn read() -> Result<Self> {
        let arguments = ["ls-files", "-z", "--cached", "--others", "--exclude-standard"];
        let listing = workspace::command("git", &arguments).output().context("cannot run git")?;
        ensure!(listing.status.success(), "git ls-files: {}", String::from_utf8_lossy(&listing.stderr));
        let listing = String::from_utf8(listing.stdout).context("file names must be UTF-8")?;
        let mut tree = Self::default();
        for path in listing.split_terminator('\0') {
            // A file removed but not yet staged is still listed; a binary file has no text to check.
            let Ok(bytes) = fs::read(workspace::root().join(path)) else { continue };
            tree.paths.push(path.to_owned());
            if let Ok(text) = String::from_utf8(bytes) {
                tree.files.push(SourceFile { path: path.to_owned(), text });
            }
        }
        Ok(tree)
    }

    /// Whether `path` is a file or a folder of the tree.
    pub(crate) fn contains(&self, path: &str) -> bool {
        let folder = format!("{path}/");
        self.paths.iter().any(|p| p == path || p.starts_with(&folder))
    }

    #[cfg(test)]
    pub(crate) fn of(files: &[(&str, &str)]) -> Self {
        Self {
            paths: files.iter().map(|(path, _)| (*path).to_owned()).collect(),
            files: files
                .iter()
                .map(|(path, text)| SourceFile { path: (*path).to_owned(), text: (*text).to_owned() })
                .collect(),
        }
    }
}

/// A violation of a rule.
#[derive(Debug)]
pub(crate) struct Finding {
    pub path: String,
    pub line: usize,
    pub message: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.path, self.line, self.message)
    }
}
