//! Files that lie: single places of a valid map overwritten, all checksums made to fit again.

/// Length of the preamble.
const PREAMBLE: usize = 64;
/// Where its digest begins.
const DIGEST: usize = 32;

fn number(bytes: &[u8], at: usize) -> usize {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
}

/// Where the header lies.
pub(crate) fn header_range(bytes: &[u8]) -> std::ops::Range<usize> {
    let offset = number(bytes, 16);
    offset..offset + number(bytes, 24)
}

/// Makes the digest of preamble and header fit.
pub(crate) fn seal(bytes: &mut [u8]) {
    let header = header_range(bytes);
    let digest = blake3::Hasher::new().update(&bytes[..DIGEST]).update(&bytes[header]).finalize();
    bytes[DIGEST..PREAMBLE].copy_from_slice(digest.as_bytes());
}

/// A section of the file, found by its name in the header.
pub(crate) struct Section {
    /// Its bytes.
    pub range: std::ops::Range<usize>,
    /// Where the header states offset, length and digest.
    pub stated_at: usize,
}

/// The section called `name`.
pub(crate) fn section(bytes: &[u8], name: &str) -> Section {
    let header = header_range(bytes);
    let text = [&(name.len() as u64).to_le_bytes(), name.as_bytes()].concat();
    let found = bytes[header.clone()].windows(text.len()).position(|window| window == text).unwrap();
    let stated_at = header.start + found + text.len();
    let offset = number(bytes, stated_at);
    Section { range: offset..offset + number(bytes, stated_at + 8), stated_at }
}

/// `sound` with `value` at byte `at` of its header.
pub(crate) fn in_header(sound: &[u8], at: usize, value: &[u8]) -> Vec<u8> {
    let mut forged = sound.to_vec();
    forged[at..at + value.len()].copy_from_slice(value);
    seal(&mut forged);
    forged
}

/// `sound` with `value` at byte `at` of its section `name`.
pub(crate) fn in_section(sound: &[u8], name: &str, at: usize, value: &[u8]) -> Vec<u8> {
    let mut forged = sound.to_vec();
    let Section { range, stated_at } = section(sound, name);
    forged[range.start + at..range.start + at + value.len()].copy_from_slice(value);
    let digest = blake3::hash(&forged[range]);
    forged[stated_at + 16..stated_at + 48].copy_from_slice(digest.as_bytes());
    seal(&mut forged);
    forged
}

/// Numbers that a careless reader multiplies, allocates or indexes with.
pub(crate) const ABSURD: [u64; 6] = [0, 1, 1 << 20, 1 << 32, 1 << 62, u64::MAX];
