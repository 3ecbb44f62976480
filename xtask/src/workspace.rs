//! Where the workspace is, and the files in it.

use std::path::Path;

/// The folder of the root manifest.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask is a member one level below the root")
}
