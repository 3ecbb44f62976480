//! The layout of the file (docs/formats/sonelmap.md): preamble, chunks, sections, header.
//!
//! Chunks are appended as they are traced; everything that is known only at the end (directory, ledgers, header) follows
//! them, and the preamble is filled in last. A run that was stopped leaves a preamble of zeros behind its magic.

use bytemuck::{Pod, Zeroable};

/// First eight bytes of every map.
pub(crate) const MAGIC: [u8; 8] = *b"SONELMAP";
/// Major version: readers refuse others.
pub(crate) const MAJOR: u16 = 1;
/// Minor version: later ones only add.
pub(crate) const MINOR: u16 = 0;
/// Name of the section that only scenes with a gradient of the speed of sound have: its value [1/s].
pub(crate) const GRADIENT: &str = "sound_speed_gradient";
/// Chunks and sections begin at multiples of this.
pub(crate) const ALIGNMENT: u64 = 64;

/// The first 64 bytes.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Preamble {
    /// [`MAGIC`].
    pub magic: [u8; 8],
    /// [`MAJOR`].
    pub major: u16,
    /// [`MINOR`].
    pub minor: u16,
    /// Zero.
    pub reserved: u32,
    /// Begin of the header [bytes]; zero while the map is being written.
    pub header_offset: u64,
    /// Length of the header [bytes]; the file ends with it.
    pub header_length: u64,
    /// BLAKE3 of everything above and the header: [`Preamble::digest_with`].
    pub header_digest: [u8; 32],
}

impl Preamble {
    /// BLAKE3 of this preamble, its own digest left out, followed by the bytes of the header.
    #[must_use]
    pub(crate) fn digest_with(&self, header: &[u8]) -> [u8; 32] {
        let before_digest = &bytemuck::bytes_of(self)[..size_of::<Self>() - size_of::<[u8; 32]>()];
        blake3::Hasher::new().update(before_digest).update(header).finalize().into()
    }
}

/// One row of the chunk directory: 64 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ChunkEntry {
    /// Index of the source.
    pub source: u32,
    /// Paths in the chunk.
    pub path_count: u32,
    /// Emission index of its first path.
    pub first_emission: u64,
    /// Vertices of all its paths.
    pub vertex_count: u64,
    /// Begin in the file [bytes].
    pub offset: u64,
    /// BLAKE3 of its bytes.
    pub digest: [u8; 32],
}

impl ChunkEntry {
    /// Begin of its vertices, from the beginning of the chunk [bytes].
    #[must_use]
    pub(crate) fn vertices_at(&self) -> u64 {
        aligned(u64::from(self.path_count) * 4)
    }

    /// Length [bytes]; [`None`] where the counts overflow.
    #[must_use]
    pub(crate) fn length(&self) -> Option<u64> {
        self.vertex_count.checked_mul(16)?.checked_add(self.vertices_at())
    }
}

/// Properties of a surface, so that a reader need not find surfaces in a mesh as `sonel-geometry` does: 48 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SurfaceRow {
    /// Index of its material.
    pub material: u32,
    /// 1 where it belongs to a closed shell, so that its front is the side of the air; 0 for a free panel.
    pub closed: u32,
    /// Unit normal that points to the front.
    pub normal: [f64; 3],
    /// The surface is at normal · x = offset, in the axes of the scene [m].
    pub offset: f64,
    /// Area of one side [m²].
    pub area: f64,
}

/// Fates and segments of one chunk: 64 bytes.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ChunkFates {
    /// Packets per fate.
    pub fates: [u64; 5],
    /// Segments traced.
    pub segments: u64,
    /// Zero.
    pub reserved: [u64; 2],
}

impl ChunkFates {
    /// Whether every packet of `chunk` has one fate and every vertex ends one segment but those at which one more packet begins.
    #[must_use]
    pub(crate) fn agree_with(&self, chunk: &ChunkEntry) -> bool {
        let fates = self.fates.iter().try_fold(0, |sum: u64, &count| sum.checked_add(count));
        let split = fates.and_then(|fates| fates.checked_sub(u64::from(chunk.path_count)));
        split.and_then(|split| split.checked_add(self.segments)) == Some(chunk.vertex_count)
    }
}

/// The next multiple of [`ALIGNMENT`].
#[must_use]
pub(crate) fn aligned(offset: u64) -> u64 {
    offset.next_multiple_of(ALIGNMENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_have_the_documented_sizes() {
        assert_eq!(size_of::<Preamble>(), 64);
        assert_eq!(size_of::<ChunkEntry>(), 64);
        assert_eq!(size_of::<ChunkFates>(), 64);
        assert_eq!(size_of::<SurfaceRow>(), 48);
    }
}
