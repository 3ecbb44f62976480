//! Maps in temporary files.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use crate::study::pipeline::MapStore;
use sonel_map::{MapError, SonelMap};

/// Keeps each map in a file without name, so that it may be larger than memory; the file is gone with the map.
#[derive(Debug, Clone, Default)]
pub struct TemporaryMaps {
    folder: Option<PathBuf>,
}

impl TemporaryMaps {
    /// Keeps maps in `folder` instead of that of the system.
    #[must_use]
    pub fn new(folder: PathBuf) -> Self {
        Self { folder: Some(folder) }
    }
}

impl MapStore for TemporaryMaps {
    type Writer = BufWriter<File>;

    fn begin(&mut self) -> std::io::Result<Self::Writer> {
        let file = self.folder.as_ref().map_or_else(tempfile::tempfile, tempfile::tempfile_in)?;
        Ok(BufWriter::with_capacity(1 << 20, file))
    }

    fn open(&mut self, mut written: Self::Writer) -> Result<SonelMap, MapError> {
        written.flush()?;
        SonelMap::open(written.get_ref())
    }
}
