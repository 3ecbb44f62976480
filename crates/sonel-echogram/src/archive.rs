//! Numpy archives: named arrays in an uncompressed zip file with constant time stamps, so that the same response has the
//! same bytes.
//!
//! The zip format has checksums of contents, none of names. A digest over both, as the last array, tells an archive whose directory was
//! damaged.

use std::collections::HashMap;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use crate::{ResponseError, header};

/// Archives larger than this need the 64-bit zip extension for their entries.
const LARGE_ENTRY: usize = u32::MAX as usize / 2;

/// The array that holds the digest of all others.
const DIGEST: &str = "digest";

/// Size of the buffer before the archive [bytes]. Speed alone depends on it.
const BUFFER: usize = 1 << 16;

/// Values of an array; read by [`ArchiveReader::array`].
pub(crate) trait Element: Sized {
    /// Whether numpy calls the type so.
    fn is(type_string: &str) -> bool;

    /// The values in `payload`, each `size` bytes.
    fn read(payload: &[u8], size: usize) -> Vec<Self>;
}

/// A number of numpy.
pub trait Number: Copy {
    /// Type as numpy writes it.
    const TYPE: &'static str;

    /// Appends its bytes, the lowest first.
    fn put(self, bytes: &mut Vec<u8>);
}

macro_rules! numbers {
    ($($number:ty = $name:literal)*) => {
        $(
            impl Number for $number {
                const TYPE: &'static str = $name;

                fn put(self, bytes: &mut Vec<u8>) {
                    bytes.extend(self.to_le_bytes());
                }
            }

            impl Element for $number {
                fn is(type_string: &str) -> bool {
                    type_string == Self::TYPE
                }

                fn read(payload: &[u8], _: usize) -> Vec<Self> {
                    let (numbers, _) = payload.as_chunks();
                    numbers.iter().map(|&bytes| Self::from_le_bytes(bytes)).collect()
                }
            }
        )*
    };
}

numbers!(u8 = "|u1" u32 = "<u4" u64 = "<u8" f32 = "<f4" f64 = "<f8");

impl Number for bool {
    const TYPE: &'static str = "|b1";

    fn put(self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(self));
    }
}

/// A text of fixed width, filled up with zeros; what is no character becomes U+FFFD.
impl Element for String {
    fn is(type_string: &str) -> bool {
        type_string.starts_with("<U")
    }

    fn read(payload: &[u8], size: usize) -> Vec<Self> {
        let text = |bytes: &[u8]| {
            let codes = u32::read(bytes, 4);
            let end = codes.iter().rposition(|&code| code != 0).map_or(0, |last| last + 1);
            codes[..end]
                .iter()
                .map(|&code| char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER))
                .collect()
        };
        payload.chunks_exact(size.max(1)).map(text).collect()
    }
}

/// Shape of an array and its values in row-major order.
pub(crate) type Shaped<T> = (Vec<usize>, Vec<T>);

/// An archive being written: arrays of plain numbers and texts, for `numpy.load` without pickle.
#[derive(Debug)]
pub struct ArchiveWriter<W: Write + Seek> {
    zip: ZipWriter<UntilFailure<W>>,
    /// Name of the array being written, and the hash of its content so far.
    array: (String, blake3::Hasher),
    digest: blake3::Hasher,
}

/// Adds an array to a digest: BLAKE3 of the BLAKE3 of name and content of every array, in the order of the archive.
fn add_to_digest(digest: &mut blake3::Hasher, name: &str, content: blake3::Hash) {
    digest.update(blake3::hash(name.as_bytes()).as_bytes()).update(content.as_bytes());
}

/// An array being written, see [`ArchiveWriter::array`].
pub struct ArrayWriter<'a, T: Number, W: Write + Seek> {
    archive: &'a mut ArchiveWriter<W>,
    /// Bytes that are not in the archive yet.
    buffer: Vec<u8>,
    /// Values that are still to come.
    missing: usize,
    values: PhantomData<T>,
}

impl<T: Number, W: Write + Seek> ArrayWriter<'_, T, W> {
    /// Adds values in row-major order.
    ///
    /// # Errors
    /// When the archive cannot be written, or the values are more than the shape says.
    pub fn extend(&mut self, values: &[T]) -> io::Result<()> {
        self.missing = self.missing.checked_sub(values.len()).ok_or_else(wrong_count)?;
        for value in values {
            value.put(&mut self.buffer);
            if self.buffer.len() >= BUFFER {
                self.archive.put(&self.buffer)?;
                self.buffer.clear();
            }
        }
        Ok(())
    }

    /// Completes the array.
    ///
    /// # Errors
    /// When the archive cannot be written, or the values are fewer than the shape says.
    pub fn finish(self) -> io::Result<()> {
        if self.missing > 0 { Err(wrong_count()) } else { self.archive.put(&self.buffer) }
    }
}

fn wrong_count() -> io::Error {
    io::Error::other("an array has other values than its shape says")
}

impl<W: Write + Seek> ArchiveWriter<W> {
    /// Begins an archive.
    pub fn new(out: W) -> Self {
        Self {
            zip: ZipWriter::new(UntilFailure { out, position: 0, has_failed: false }),
            array: Default::default(),
            digest: blake3::Hasher::new(),
        }
    }

    /// Begins an array of numbers whose values come later.
    ///
    /// # Errors
    /// When the archive cannot be written.
    pub fn array<T: Number>(
        &mut self,
        key: &str,
        shape: &[usize],
    ) -> Result<ArrayWriter<'_, T, W>, ResponseError> {
        let missing: usize = shape.iter().product();
        self.begin(key, size_of::<T>().saturating_mul(missing))?;
        let buffer = header::written(T::TYPE, shape)?;
        Ok(ArrayWriter { archive: self, buffer, missing, values: PhantomData })
    }

    /// Adds numbers in row-major order.
    ///
    /// # Errors
    /// When the archive cannot be written.
    pub fn numbers<T: Number>(
        &mut self,
        key: &str,
        shape: &[usize],
        values: &[T],
    ) -> Result<(), ResponseError> {
        let mut array = self.array(key, shape)?;
        array.extend(values)?;
        Ok(array.finish()?)
    }

    /// Adds texts as fixed-width unicode; an empty `shape` makes a single one.
    ///
    /// # Errors
    /// When the archive cannot be written.
    pub fn texts(&mut self, key: &str, shape: &[usize], values: &[&str]) -> Result<(), ResponseError> {
        let width = values.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
        let mut bytes = header::written(&format!("<U{width}"), shape)?;
        for text in values {
            let codes = text.chars().map(u32::from).chain(std::iter::repeat(0)).take(width);
            codes.for_each(|code| code.put(&mut bytes));
        }
        self.begin(key, bytes.len())?;
        Ok(self.put(&bytes)?)
    }

    /// Completes the archive with a digest of all its arrays (`ArchiveReader::check_digest`) and returns what it was written to.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish_with_digest(mut self) -> Result<W, ResponseError> {
        self.complete_array();
        let digest = self.digest.finalize().to_hex();
        self.texts(DIGEST, &[], &[&digest])?;
        self.finish()
    }

    /// Completes the archive and returns what it was written to.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(self) -> Result<W, ResponseError> {
        let UntilFailure { out, has_failed, .. } = self.zip.finish().map_err(broken)?;
        if has_failed { Err(io::Error::other("an earlier write failed").into()) } else { Ok(out) }
    }

    fn complete_array(&mut self) {
        let (name, content) = std::mem::take(&mut self.array);
        if !name.is_empty() {
            add_to_digest(&mut self.digest, &name, content.finalize());
        }
    }

    fn begin(&mut self, key: &str, bytes: usize) -> Result<(), ResponseError> {
        self.complete_array();
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .unix_permissions(0o644)
            .large_file(bytes > LARGE_ENTRY);
        self.array.0 = format!("{key}.npy");
        self.zip.start_file(&self.array.0, options).map_err(broken)
    }

    /// Adds to the content of the array that was begun.
    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.array.1.update(bytes);
        self.zip.write_all(bytes)
    }
}

/// Passes on what is written until that fails, which it reports once. What follows is dropped without an error: a [`ZipWriter`] that
/// is dropped completes its archive first, and would print to stderr that it cannot.
#[derive(Debug)]
struct UntilFailure<W> {
    out: W,
    /// In bytes from the begin.
    position: u64,
    has_failed: bool,
}

impl<W: Write + Seek> UntilFailure<W> {
    fn attempt<T>(&mut self, work: impl FnOnce(&mut W) -> io::Result<T>) -> io::Result<T> {
        let result = work(&mut self.out);
        self.has_failed = result.as_ref().is_err_and(|error| error.kind() != io::ErrorKind::Interrupted);
        result
    }
}

impl<W: Write + Seek> Write for UntilFailure<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = if self.has_failed { bytes.len() } else { self.attempt(|out| out.write(bytes))? };
        self.position += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.has_failed { Ok(()) } else { self.attempt(Write::flush) }
    }
}

impl<W: Write + Seek> Seek for UntilFailure<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.position = match to {
            _ if !self.has_failed => self.attempt(|out| out.seek(to))?,
            SeekFrom::Start(position) => position,
            SeekFrom::Current(step) => self.position.saturating_add_signed(step),
            SeekFrom::End(_) => self.position,
        };
        Ok(self.position)
    }
}

/// Largest ratio of an array to its compressed archive [1], above [`SMALL_ARRAY`]: it bounds the memory that a hostile file claims. Chosen;
/// echograms that decay compress less.
const MOST_EXPANSION: u64 = 100;
/// Size up to which an array may be compressed by whatever factor [bytes]: 64 MB, which any machine has.
const SMALL_ARRAY: u64 = 1 << 26;

/// An archive being read.
pub(crate) struct ArchiveReader<R: Read + Seek> {
    zip: ZipArchive<R>,
    /// Bytes that an array may take, by the size of the archive.
    largest: u64,
    /// Hashes of the arrays read so far.
    contents: HashMap<usize, blake3::Hash>,
}

impl<R: Read + Seek> ArchiveReader<R> {
    pub(crate) fn new(mut input: R) -> Result<Self, ResponseError> {
        let size = input.seek(SeekFrom::End(0))?;
        let largest = size.saturating_mul(MOST_EXPANSION).max(SMALL_ARRAY);
        Ok(Self { largest, zip: ZipArchive::new(input).map_err(broken)?, contents: HashMap::new() })
    }

    /// Whether there is an array `key`.
    pub(crate) fn contains(&self, key: &str) -> bool {
        self.zip.index_for_name(&format!("{key}.npy")).is_some()
    }

    /// Shape and values of array `key` in row-major order; [`None`] where there is no such array.
    pub(crate) fn array<T: Element>(&mut self, key: &str) -> Result<Option<Shaped<T>>, ResponseError> {
        let Some(index) = self.zip.index_for_name(&format!("{key}.npy")) else { return Ok(None) };
        let bytes = self.content(index)?;
        let header::PlainArray { element, shape, payload } =
            header::read(&bytes).map_err(|problem| wrong(key, problem))?;
        if !T::is(element) {
            return Err(wrong(key, format!("has another type: {element}")));
        }
        let count: usize = shape.iter().product();
        let values = T::read(payload, payload.len() / count.max(1));
        Ok(Some((shape, values)))
    }

    /// Bytes first: the checksum is compared, and a header that claims more than there is cannot claim memory.
    fn content(&mut self, index: usize) -> Result<Vec<u8>, ResponseError> {
        let mut entry = self.zip.by_index(index).map_err(broken)?;
        let wrong = |name: &str, problem: String| ResponseError::Archive(format!("array {name}: {problem}"));
        let mut bytes = Vec::new();
        let read = entry.by_ref().take(self.largest + 1).read_to_end(&mut bytes);
        read.map_err(|error| wrong(entry.name(), error.to_string()))?;
        if bytes.len() as u64 > self.largest {
            let problem =
                format!("it takes more than {} bytes, too many for an archive of this size", self.largest);
            return Err(wrong(entry.name(), problem));
        }
        self.contents.insert(index, blake3::hash(&bytes));
        Ok(bytes)
    }

    /// Compares names and contents of all arrays with the digest of the archive, which is its last array.
    pub(crate) fn check_digest(&mut self) -> Result<(), ResponseError> {
        let (_, stated) =
            self.array::<String>(DIGEST)?.ok_or_else(|| ResponseError::Missing(DIGEST.to_owned()))?;
        let mut digest = blake3::Hasher::new();
        for index in 0..self.zip.len() - 1 {
            let content = match self.contents.get(&index) {
                Some(&content) => content,
                None => blake3::hash(&self.content(index)?),
            };
            add_to_digest(&mut digest, self.zip.name_for_index(index).unwrap_or_default(), content);
        }
        let is_same = stated.len() == 1 && digest.finalize().to_hex().as_str() == stated[0];
        let damaged = "names or contents of arrays do not match the digest";
        if is_same { Ok(()) } else { Err(ResponseError::Archive(damaged.to_owned())) }
    }
}

/// The error of an array that is not what the interface says.
pub(crate) fn wrong(key: &str, problem: String) -> ResponseError {
    ResponseError::Array { key: key.to_owned(), problem }
}

fn broken(error: zip::result::ZipError) -> ResponseError {
    match error {
        zip::result::ZipError::Io(error) if error.kind() != std::io::ErrorKind::UnexpectedEof => error.into(),
        error => ResponseError::Archive(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn small_archives_of_large_arrays_are_refused() {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
        zip.start_file("energy.npy", options).unwrap();
        for _ in 0..=SMALL_ARRAY >> 20 {
            zip.write_all(&vec![0; 1 << 20]).unwrap();
        }
        let archive = zip.finish().unwrap();
        assert!(archive.get_ref().len() < 1 << 20);
        let error = ArchiveReader::new(archive).unwrap().array::<f64>("energy").unwrap_err();
        assert!(error.to_string().contains("too many for an archive of this size"), "{error}");
    }
}
