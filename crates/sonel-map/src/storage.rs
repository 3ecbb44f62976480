//! The bytes of a map: mapped from a file, or in memory.
//!
//! A mapped file may be written to by another process. Every count and offset is compared with the length when it is used, so that nothing
//! outside is read whatever is written; a file that is cut off ends the process by a signal (SIGBUS), which programs report. What was read may
//! then be of two contents, or zeros behind the new end: [`Storage::require_unchanged`] tells.

use std::fs::{File, Metadata};

use memmap2::Mmap;

use crate::error::MapError;

/// Where the bytes of a map are. Both begin at an address that suits every record.
#[derive(Debug)]
pub(crate) enum Storage {
    /// In a file, which was as `before` says.
    Mapped { map: Mmap, file: File, before: Metadata },
    /// In memory.
    Memory { words: Vec<u64>, length: usize },
}

impl Storage {
    /// Maps a regular file.
    pub(crate) fn of_file(file: &File) -> Result<Self, MapError> {
        let (file, before) = (file.try_clone()?, file.metadata()?);
        if !before.is_file() {
            return Err(MapError::NotAMap);
        }
        // SAFETY: the mapping is read-only and dropped with the map. The bytes may change beneath it, as the module says: they are plain numbers, of
        // which any value is valid, and checked again where they are used as places.
        #[allow(unsafe_code)]
        let map = unsafe { Mmap::map(&file)? };
        Ok(Self::Mapped { map, file, before })
    }

    /// A copy of `bytes`.
    pub(crate) fn of_bytes(bytes: &[u8]) -> Self {
        let mut words = vec![0_u64; bytes.len().div_ceil(8)];
        bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
        Self::Memory { words, length: bytes.len() }
    }

    pub(crate) fn as_slice(&self) -> &[u8] {
        match self {
            Self::Mapped { map, .. } => map,
            Self::Memory { words, length } => &bytemuck::cast_slice(words)[..*length],
        }
    }

    /// Refuses a file that was written to.
    pub(crate) fn require_unchanged(&self) -> Result<(), MapError> {
        let Self::Mapped { file, before, .. } = self else { return Ok(()) };
        let now = file.metadata()?;
        let is_same = now.len() == before.len() && now.modified().ok() == before.modified().ok();
        if is_same { Ok(()) } else { Err(MapError::Changed) }
    }
}
