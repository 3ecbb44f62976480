//! Maps and responses, told by their first bytes.

use std::io::Read;
use std::path::Path;

use anyhow::Context;

use crate::input;

/// How a map begins.
const MAP_MAGIC: &[u8] = b"SONELMAP";
/// How a numpy archive begins.
const ARCHIVE_MAGIC: &[u8] = b"PK";

/// A kind of file that programs pass on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Artifact {
    /// Map of sonel-trace.
    Map,
    /// Response of sonel-render.
    Response,
}

/// What the file in `path` is; [`None`] where it is neither.
///
/// # Errors
/// When it cannot be read.
pub fn kind(path: &Path) -> anyhow::Result<Option<Artifact>> {
    let mut start = Vec::new();
    let file = input::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    file.take(8).read_to_end(&mut start).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(match &start[..] {
        MAP_MAGIC => Some(Artifact::Map),
        start if start.starts_with(ARCHIVE_MAGIC) => Some(Artifact::Response),
        _ => None,
    })
}
