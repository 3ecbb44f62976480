//! Opening what the other programs wrote; every error names the file.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use anyhow::Context;
use sonel_echogram::Response;

/// The response in `path`.
///
/// # Errors
/// When the file cannot be read or is no sound response.
pub fn response(path: &Path) -> anyhow::Result<Response> {
    let file = file(path)?;
    Response::read(BufReader::new(file)).with_context(|| path.display().to_string())
}

fn file(path: &Path) -> anyhow::Result<File> {
    File::open(path).with_context(|| format!("cannot open {}", path.display()))
}
