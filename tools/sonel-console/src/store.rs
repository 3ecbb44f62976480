//! Temporary map files of studies.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use sonel_map::{MapError, SonelMap};
use sonel_study::pipeline::MapStore;

/// Keeps each map in a file without name in a folder, so that it may be larger than memory; the file is gone with the map.
#[derive(Debug, Clone)]
pub struct TemporaryMaps {
    folder: PathBuf,
}

impl TemporaryMaps {
    /// In `folder`.
    #[must_use]
    pub fn new(folder: PathBuf) -> Self {
        Self { folder }
    }
}

impl MapStore for TemporaryMaps {
    type Writer = BufWriter<File>;

    fn begin(&mut self) -> std::io::Result<Self::Writer> {
        Ok(BufWriter::with_capacity(1 << 20, tempfile::tempfile_in(&self.folder)?))
    }

    fn open(&mut self, mut written: Self::Writer) -> Result<SonelMap, MapError> {
        written.flush()?;
        SonelMap::open(written.get_ref())
    }
}
