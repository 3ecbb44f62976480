//! Writing a map as it is traced: chunks first, then everything known only at the end.

use std::io::{Seek, SeekFrom, Write};

use bytemuck::{NoUninit, Zeroable};
use sonel_geometry::Geometry;

use crate::codec::{self, Encode, SectionRecord};
use crate::directivity;
use crate::error::MapError;
use crate::format::{ALIGNMENT, ChunkEntry, ChunkFates, GRADIENT, MAGIC, MAJOR, MINOR, Preamble, aligned};
use crate::header::MapHeader;
use crate::ledger::{BandLedger, Ledger};
use crate::media;
use crate::reader::PathView;
use crate::record;
use crate::surfaces;
use crate::variants;
use crate::vertex::{SURFACE_LIMIT, Vertex};

/// The paths of one chunk: where each ends among the vertices, and the vertices of all.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ChunkPaths {
    /// For each path the index behind its last vertex.
    pub ends: Vec<u32>,
    /// Vertices of all paths in order.
    pub vertices: Vec<Vertex>,
}

impl ChunkPaths {
    /// The paths, of which the first is that of emission `first`.
    pub fn from(&self, first: u64) -> impl Iterator<Item = PathView<'_>> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        let path = |((start, &end), emission)| PathView {
            emission,
            vertices: &self.vertices[start as usize..end as usize],
        };
        starts.zip(&self.ends).zip(first..).map(path)
    }
}

/// A map being written. Memory grows by a few hundred bytes a chunk, not with the sonels.
#[derive(Debug)]
pub struct MapWriter<W> {
    out: W,
    position: u64,
    entries: Vec<ChunkEntry>,
    fates: Vec<ChunkFates>,
    ledgers: Vec<BandLedger>,
}

impl<W: Write + Seek> MapWriter<W> {
    /// Begins a map at the beginning of `out`.
    ///
    /// # Errors
    /// When `out` cannot be written.
    pub fn begin(mut out: W) -> Result<Self, MapError> {
        let unfinished = Preamble { magic: MAGIC, major: MAJOR, minor: MINOR, ..Preamble::zeroed() };
        out.write_all(bytemuck::bytes_of(&unfinished))?;
        Ok(Self { out, position: ALIGNMENT, entries: Vec::new(), fates: Vec::new(), ledgers: Vec::new() })
    }

    /// Appends the chunk of `source` that begins with emission `first_emission`.
    ///
    /// # Errors
    /// When `out` cannot be written.
    pub fn push_chunk(
        &mut self,
        source: u32,
        first_emission: u64,
        paths: &ChunkPaths,
        ledger: &Ledger,
    ) -> Result<(), MapError> {
        let offset = self.pad()?;
        let mut entry = ChunkEntry {
            source,
            path_count: paths.ends.len() as u32,
            first_emission,
            vertex_count: paths.vertices.len() as u64,
            offset,
            digest: [0; 32],
        };
        let mut ends = bytemuck::cast_slice::<u32, u8>(&paths.ends).to_vec();
        ends.resize(entry.vertices_at() as usize, 0);
        let vertices = bytemuck::cast_slice::<Vertex, u8>(&paths.vertices);
        entry.digest = blake3::Hasher::new().update(&ends).update(vertices).finalize().into();
        self.put(&ends)?;
        self.put(vertices)?;
        self.enter(entry, ledger);
        Ok(())
    }

    /// Appends a chunk of another map, whose `bytes` have been compared with its checksum.
    pub(crate) fn push_copy(
        &mut self,
        chunk: &ChunkEntry,
        bytes: &[u8],
        ledger: &Ledger,
    ) -> Result<(), MapError> {
        let offset = self.pad()?;
        self.put(bytes)?;
        self.enter(ChunkEntry { offset, ..*chunk }, ledger);
        Ok(())
    }

    fn enter(&mut self, chunk: ChunkEntry, ledger: &Ledger) {
        self.entries.push(chunk);
        self.fates.push(ChunkFates {
            fates: ledger.fates.counts(),
            segments: ledger.segments,
            reserved: [0; 2],
        });
        self.ledgers.extend(&ledger.bands);
    }

    /// Vertices written so far.
    #[must_use]
    pub fn vertex_count(&self) -> u64 {
        self.entries.iter().map(|entry| entry.vertex_count).sum()
    }

    /// Completes the map and returns what it was written to. `geometry` is that of the scene in `header`.
    ///
    /// # Errors
    /// When `out` cannot be written or the header is too large.
    pub fn finish(mut self, header: &MapHeader, geometry: &Geometry) -> Result<W, MapError> {
        if geometry.surfaces().len() >= SURFACE_LIMIT as usize {
            return Err(MapError::Limit(format!(
                "a map names fewer than {SURFACE_LIMIT} surfaces; join walls"
            )));
        }
        let (corners, triangles) = record::mesh_columns(&header.scene.mesh);
        let (entries, fates) = (std::mem::take(&mut self.entries), std::mem::take(&mut self.fates));
        let ledgers = std::mem::take(&mut self.ledgers);
        let mut sections = vec![
            self.section("mesh.vertices", &corners)?,
            self.section("mesh.triangles", &triangles)?,
            self.section("surfaces", &surfaces::rows(geometry))?,
            self.section("chunks", &entries)?,
            self.section("chunk.fates", &fates)?,
            self.section("chunk.ledger", &ledgers)?,
        ];
        let scene = &header.scene;
        sections.extend(self.optional(record::LAWS, record::laws(&scene.materials))?);
        sections.extend(self.optional(record::CHANGES, record::changes(&scene.sources))?);
        sections.extend(self.optional(record::AIR_AT, record::air_at(&scene.air_at))?);
        let media = scene.media.as_ref().map(media::record);
        sections.extend(self.record(media::SECTION, media)?);
        sections.extend(self.record(directivity::SECTION, directivity::record(scene))?);
        sections.extend(self.record(variants::SECTION, variants::record(scene))?);
        sections.extend(self.record(variants::DESIGNS, variants::designs(scene))?);
        let gradient = (scene.sound_speed_gradient != 0.0).then(|| vec![scene.sound_speed_gradient]);
        sections.extend(self.optional(GRADIENT, gradient)?);
        let record = record::header_record(header, geometry.center(), sections);
        let bytes = codec::encode(&record).map_err(MapError::Limit)?;
        let header_offset = self.pad()?;
        self.put(&bytes)?;
        let mut preamble = Preamble {
            magic: MAGIC,
            major: MAJOR,
            minor: MINOR,
            reserved: 0,
            header_offset,
            header_length: bytes.len() as u64,
            header_digest: [0; 32],
        };
        preamble.header_digest = preamble.digest_with(&bytes);
        self.out.seek(SeekFrom::Start(0))?;
        self.out.write_all(bytemuck::bytes_of(&preamble))?;
        self.out.flush()?;
        Ok(self.out)
    }

    fn section<T: NoUninit>(&mut self, name: &str, rows: &[T]) -> Result<SectionRecord, MapError> {
        let (offset, bytes) = (self.pad()?, bytemuck::cast_slice(rows));
        self.put(bytes)?;
        let digest = blake3::hash(bytes).into();
        Ok(SectionRecord { name: name.to_owned(), offset, length: bytes.len() as u64, digest })
    }

    /// A section that only maps with something to say in it have.
    fn optional<T: NoUninit>(
        &mut self,
        name: &str,
        rows: Option<Vec<T>>,
    ) -> Result<Option<SectionRecord>, MapError> {
        rows.map(|rows| self.section(name, &rows)).transpose()
    }

    /// The same of a record.
    fn record<R: Encode>(
        &mut self,
        name: &str,
        record: Option<R>,
    ) -> Result<Option<SectionRecord>, MapError> {
        let bytes = record.map(|record| codec::encode(&record)).transpose().map_err(MapError::Limit)?;
        self.optional(name, bytes)
    }

    /// Zeros up to the next aligned position, which is returned.
    fn pad(&mut self) -> Result<u64, MapError> {
        let gap = aligned(self.position) - self.position;
        self.put(&[0; ALIGNMENT as usize][..gap as usize])?;
        Ok(self.position)
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), MapError> {
        self.out.write_all(bytes)?;
        self.position += bytes.len() as u64;
        Ok(())
    }
}
