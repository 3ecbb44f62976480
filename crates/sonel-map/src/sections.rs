//! The header of a map file and the sections that it names, each checked against its digest.

use crate::codec::{self, Decode, HeaderRecord};
use crate::error::MapError;
use crate::format::{MAGIC, MAJOR, MINOR, Preamble};

/// The preamble of a map of a version that is read.
pub(crate) fn read_preamble(bytes: &[u8]) -> Result<Preamble, MapError> {
    if !bytes.starts_with(&MAGIC) {
        return Err(MapError::NotAMap);
    }
    let length = bytes.len() as u64;
    let preamble = bytes
        .get(..size_of::<Preamble>())
        .map(bytemuck::pod_read_unaligned::<Preamble>)
        .ok_or_else(|| MapError::Truncated { part: "the preamble".to_owned(), end: 64, length })?;
    if preamble.major != MAJOR {
        let (major, minor) = (preamble.major, preamble.minor);
        return Err(MapError::UnsupportedVersion { major, minor, supported: MAJOR });
    }
    if preamble.header_offset == 0 {
        return Err(MapError::Incomplete);
    }
    Ok(preamble)
}

/// The bytes of the range, which must lie in the file.
fn part<'a>(bytes: &'a [u8], offset: u64, length: u64, name: &str) -> Result<&'a [u8], MapError> {
    let end = offset.saturating_add(length);
    if end > bytes.len() as u64 {
        return Err(MapError::Truncated { part: name.to_owned(), end, length: bytes.len() as u64 });
    }
    Ok(&bytes[offset as usize..end as usize])
}

/// A map's header and what it names.
pub(crate) struct Sections<'a> {
    bytes: &'a [u8],
    /// The header.
    pub header: HeaderRecord,
    /// Begin [bytes].
    pub header_offset: u64,
}

impl<'a> Sections<'a> {
    /// Reads the header of the map in `bytes`.
    pub(crate) fn read(bytes: &'a [u8], preamble: &Preamble) -> Result<Self, MapError> {
        let damaged = |reason: String| MapError::Damaged { offset: preamble.header_offset, reason };
        let header = part(bytes, preamble.header_offset, preamble.header_length, "the header")?;
        if preamble.digest_with(header) != preamble.header_digest {
            return Err(damaged("the header does not match its checksum".to_owned()));
        }
        if preamble.header_offset + preamble.header_length != bytes.len() as u64 {
            return Err(damaged("the file has bytes after its header".to_owned()));
        }
        let may_go_on = preamble.minor > MINOR;
        let header = codec::decode(header, may_go_on).map_err(damaged)?;
        Ok(Self { bytes, header, header_offset: preamble.header_offset })
    }

    /// The error of a header that says what cannot be.
    pub(crate) fn damaged(&self, reason: String) -> MapError {
        MapError::Damaged { offset: self.header_offset, reason }
    }

    /// Whether there is a section `name`.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.header.sections.iter().any(|section| section.name == name)
    }

    /// The rows of section `name`; none where there is no such section.
    pub(crate) fn optional<T: bytemuck::AnyBitPattern>(&self, name: &str) -> Result<&'a [T], MapError> {
        if self.has(name) { self.rows(name) } else { Ok(&[]) }
    }

    /// The record that section `name` holds; [`None`] where there is no such section.
    pub(crate) fn record<D: Decode<()>>(&self, name: &str) -> Result<Option<D>, MapError> {
        if !self.has(name) {
            return Ok(None);
        }
        codec::decode(self.rows::<u8>(name)?, false).map(Some).map_err(|reason| self.damaged(reason))
    }

    /// The rows of section `name`.
    pub(crate) fn rows<T: bytemuck::AnyBitPattern>(&self, name: &str) -> Result<&'a [T], MapError> {
        let section = self.header.sections.iter().find(|section| section.name == name).ok_or_else(|| {
            MapError::Damaged { offset: 0, reason: format!("the header names no section {name}") }
        })?;
        let damaged = |reason: String| MapError::Damaged { offset: section.offset, reason };
        let bytes = part(self.bytes, section.offset, section.length, name)?;
        if <[u8; 32]>::from(blake3::hash(bytes)) != section.digest {
            return Err(damaged(format!("section {name} does not match its checksum")));
        }
        bytemuck::try_cast_slice(bytes).map_err(|error| damaged(format!("section {name}: {error}")))
    }
}
