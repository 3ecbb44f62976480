//! Chunks and sections tile the file: every byte belongs to exactly one part or is a zero of the padding between two.
//!
//! So no two rows of a forged directory share their bytes, and every flipped bit of a file is found by a checksum or here.

use crate::codec::SectionRecord;
use crate::error::MapError;
use crate::format::{ALIGNMENT, ChunkEntry, aligned};

/// Whether the parts follow one another as they were written: preamble, `chunks`, `sections`, header.
pub(crate) fn check_order(
    chunks: &[ChunkEntry],
    sections: &[SectionRecord],
    header_offset: u64,
    file_length: u64,
) -> Result<(), MapError> {
    let mut position = ALIGNMENT;
    let chunks = chunks.iter().map(|chunk| ("a chunk of paths", chunk.offset, chunk.length()));
    let sections =
        sections.iter().map(|section| (section.name.as_str(), section.offset, Some(section.length)));
    for (name, offset, length) in chunks.chain(sections) {
        if offset != aligned(position) {
            let reason = format!("{name} does not follow the part before it");
            return Err(MapError::Damaged { offset, reason });
        }
        let end = length.and_then(|length| offset.checked_add(length)).unwrap_or(u64::MAX);
        if end > file_length {
            return Err(MapError::Truncated { part: name.to_owned(), end, length: file_length });
        }
        position = end;
    }
    if header_offset == aligned(position) {
        Ok(())
    } else {
        let reason = "the header does not follow the last section".to_owned();
        Err(MapError::Damaged { offset: header_offset, reason })
    }
}

/// Whether nothing but zeros follows `end` up to the next aligned position.
pub(crate) fn check_padding(file: &[u8], end: u64) -> Result<(), MapError> {
    check_zeros(&file[end as usize..(aligned(end) as usize).min(file.len())], end)
}

/// Whether `padding`, which begins at `offset` of the file, is nothing but zeros.
pub(crate) fn check_zeros(padding: &[u8], offset: u64) -> Result<(), MapError> {
    if padding.iter().all(|&byte| byte == 0) {
        Ok(())
    } else {
        Err(MapError::Damaged { offset, reason: "the padding is not zero".to_owned() })
    }
}
