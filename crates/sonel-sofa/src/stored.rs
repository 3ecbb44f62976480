//! How the arrays of a SOFA file are stored, as far as the reader takes them for something else.
//!
//! The package sofar reads any bytes as little-endian numbers, and compressed ones as shuffled whether they are or not. Here that is told from
//! data types and from the filters in the object headers (HDF5 File Format Specification 3.0, IV.A), so that no file has other numbers than
//! it holds. An array takes no more memory than the file allows for.

use sofar::hdf::DataObject;

use crate::SofaError;

/// An array of at most so many bytes, or of this many times the file, is taken: what compression can do.
const ALWAYS_TAKEN: u64 = 64 << 20;
const LARGEST_RATIO: u64 = 100;

/// Types of messages in an object header.
const FILTERS: u8 = 0x0b;
const CONTINUATION: u8 = 0x10;
/// Filters: one that puts the first bytes of all numbers before the second ones, and so on; compression; checksums.
const SHUFFLE: u16 = 2;
const DEFLATE: u16 = 1;
const CHECKSUM: u16 = 3;

/// Checks the array `name` of `file`.
///
/// # Errors
/// What is stored otherwise than it would be read.
pub(crate) fn check(name: &str, array: &DataObject, file: &[u8]) -> Result<(), SofaError> {
    if array.dt.class_bit_field & 1 == 1 {
        return Err(format!("{name} is stored big-endian").into());
    }
    let bytes = bytes_of(array);
    if bytes > ALWAYS_TAKEN.max(LARGEST_RATIO.saturating_mul(file.len() as u64)) {
        return Err(format!("{name} claims {bytes} bytes, the file has {}", file.len()).into());
    }
    let filters = filters(file, array.address).ok_or_else(|| format!("the header of {name} is damaged"))?;
    let has = |filter: u16| filters.contains(&filter);
    let is_known = filters.iter().all(|filter| [SHUFFLE, DEFLATE, CHECKSUM].contains(filter));
    let is_of_netcdf = has(SHUFFLE) && has(DEFLATE) && is_known;
    if !(filters.is_empty() || is_of_netcdf) {
        return Err(format!(
            "{name} is stored by filters {filters:?}, not shuffled and deflated as by netCDF"
        )
        .into());
    }
    Ok(())
}

/// What the numbers of an array take in memory [bytes].
fn bytes_of(array: &DataObject) -> u64 {
    array.ds.dimension_size.iter().fold(u64::from(array.dt.size), |bytes, size| bytes.saturating_mul(*size))
}

/// Filters of the object whose header of version 2 begins at `address`; none where the header is damaged.
fn filters(file: &[u8], address: u64) -> Option<Vec<u16>> {
    let header = file.get(usize::try_from(address).ok()?..)?;
    let flags = *header.strip_prefix(b"OHDR")?.get(1)?;
    let optional = |bit: u8, bytes: usize| if flags & bit != 0 { bytes } else { 0 };
    let at = 6 + optional(0x20, 16) + optional(0x10, 4);
    let width = 1 << (flags & 3);
    let begin = at + width;
    let mut blocks = vec![header.get(begin..begin.checked_add(number(header.get(at..begin)?))?)?];
    let ordered = optional(4, 2);
    let mut next = 0;
    // A block follows another at most once for each of its messages.
    while let Some(mut block) = blocks.get(next).copied() {
        next += 1;
        while block.len() >= 4 + ordered {
            let (kind, size) = (block[0], number(&block[1..3]));
            let message = block.get(4 + ordered..)?.get(..size)?;
            match kind {
                FILTERS => return listed(message),
                CONTINUATION if next <= MOST_BLOCKS => {
                    let (place, length) = (number(message.get(..8)?), number(message.get(8..16)?));
                    // Between a signature and a checksum.
                    let more = file.get(place..place.checked_add(length.checked_sub(4)?)?)?;
                    blocks.push(more.strip_prefix(b"OCHK")?);
                }
                _ => {}
            }
            block = &block[4 + ordered + size..];
        }
    }
    Some(Vec::new())
}

/// Blocks of a header that are looked through.
const MOST_BLOCKS: usize = 64;

/// The filters of a message.
fn listed(message: &[u8]) -> Option<Vec<u16>> {
    let (version, count) = (*message.first()?, *message.get(1)?);
    let mut rest = message.get(if version == 1 { 8 } else { 2 }..)?;
    let mut found = Vec::new();
    for _ in 0..count {
        let filter = number(rest.get(..2)?) as u16;
        // Well-known filters have no names in version 2.
        let is_named = version == 1 || filter >= 256;
        let (name, at) = if is_named { (number(rest.get(2..4)?), 6) } else { (0, 4) };
        let values = number(rest.get(at..at + 2)?);
        let padding = if version == 1 { 4 * (values % 2) } else { 0 };
        found.push(filter);
        rest = rest.get(at + 2 + name + 4 * values + padding..)?;
    }
    Some(found)
}

/// A little-endian number of at most 8 bytes.
fn number(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | usize::from(*byte))
}
