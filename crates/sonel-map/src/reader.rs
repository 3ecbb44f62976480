//! Reading a map in place: opening costs the header and the directory, however large the map.
//!
//! Input is not trusted: every offset and count is checked against the file's length before it is used, nothing is
//! allocated that the file does not hold, and [`SonelMap::check_paths`] compares every checksum and every rule of the
//! layout before a program believes the paths.

use std::fs::File;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use sonel_acoustics::{Directivity, Material};
use sonel_geometry::{Geometry, LARGEST_TURN};
use sonel_scene::{Propagation, Scene, Source};

use crate::classes::BandClasses;
use crate::coefficients::CoefficientTable;
use crate::directivity;
use crate::emission::{CHUNK_EMISSIONS, EmissionLayout};
use crate::error::MapError;
use crate::format::{ChunkEntry, ChunkFates, GRADIENT, SurfaceRow};
use crate::header::{MapHeader, ShardRange};
use crate::leads::Leads;
use crate::ledger::{BandLedger, Fates, Ledger};
use crate::media;
use crate::places::{Places, is_sound_path};
use crate::record;
use crate::sections::{Sections, read_preamble};
use crate::storage::Storage;
use crate::surfaces;
use crate::tiling;
use crate::variants;
use crate::vertex::{Event, Vertex};

/// An open map. Clones share its bytes.
#[derive(Debug, Clone)]
pub struct SonelMap {
    bytes: Arc<Storage>,
    pub(crate) header: MapHeader,
    /// Minor version of the file's format.
    pub(crate) minor: u16,
    digest: [u8; 32],
    /// Origin of the stored positions in the axes of the scene [m].
    pub(crate) center: DVec3,
    /// The surfaces that the paths refer to.
    pub(crate) surfaces: Vec<SurfaceRow>,
    /// The chunks by source, then emission, and their ledgers.
    pub(crate) chunks: Vec<ChunkEntry>,
    pub(crate) ledgers: Vec<Ledger>,
    /// The materials that paths were drawn with, where the scene has others.
    drawn_with: Option<Vec<Material>>,
    /// Numbering of the emissions.
    layout: EmissionLayout,
}

/// A map without the variants of [`SonelMap::widen`].
#[derive(Debug)]
pub struct BeforeWidening {
    header: MapHeader,
    drawn_with: Option<Vec<Material>>,
}

/// One path of the map.
#[derive(Debug, Clone, Copy)]
pub struct PathView<'a> {
    /// Emission index within its source.
    pub emission: u64,
    /// Vertices, the last one final.
    pub vertices: &'a [Vertex],
}

impl SonelMap {
    /// Opens the map in `file`.
    ///
    /// # Errors
    /// When the file is no map, of another version, incomplete, cut off or damaged in its header or directory. Paths are
    /// not read; see [`Self::check_paths`].
    pub fn open(file: &File) -> Result<Self, MapError> {
        Self::from_storage(Storage::of_file(file)?)
    }

    /// Opens a map held in memory.
    ///
    /// # Errors
    /// The errors of [`Self::open`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MapError> {
        Self::from_storage(Storage::of_bytes(bytes))
    }

    fn from_storage(bytes: Storage) -> Result<Self, MapError> {
        let preamble = read_preamble(bytes.as_slice())?;
        let sections = Sections::read(bytes.as_slice(), &preamble)?;
        let damaged = |reason| MapError::Damaged { offset: preamble.header_offset, reason };
        let chunks = sections.rows::<ChunkEntry>("chunks")?.to_vec();
        check_tiling(&chunks, &sections, bytes.as_slice())?;
        let surfaces = sections.rows::<SurfaceRow>("surfaces")?.to_vec();
        let bands = sections.header.scene.nominal_frequencies.len();
        let ledgers = read_ledgers(&chunks, &sections, bands)?;
        let center = DVec3::from_array(sections.header.center);
        let header = read_header(sections, &surfaces)?;
        surfaces::check_rows(&surfaces, header.scene.materials.len()).map_err(damaged)?;
        if !center.is_finite() {
            return Err(damaged("the scene has no centre".to_owned()));
        }
        check_directory(&chunks, &header)?;
        let layout = header.settings.layout(&header.scene);
        let (minor, digest, drawn_with) = (preamble.minor, preamble.header_digest, None);
        let bytes = Arc::new(bytes);
        Ok(Self { bytes, header, minor, digest, center, surfaces, chunks, ledgers, drawn_with, layout })
    }

    /// The bytes of its file.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.as_slice()
    }

    /// Provenance.
    #[must_use]
    pub fn header(&self) -> &MapHeader {
        &self.header
    }

    /// BLAKE3 of preamble and header, which holds the digests of everything else: the identity of the map.
    #[must_use]
    pub fn digest(&self) -> [u8; 32] {
        self.digest
    }

    /// Length of the file [bytes].
    #[must_use]
    pub fn byte_length(&self) -> u64 {
        self.bytes.as_slice().len() as u64
    }

    /// Vertices stored, final ones included.
    #[must_use]
    pub fn vertex_count(&self) -> u64 {
        self.chunks.iter().map(|chunk| chunk.vertex_count).sum()
    }

    /// Sonels stored: arrivals of packets at surfaces within the run. Reads all vertices.
    #[must_use]
    pub fn sonel_count(&self) -> u64 {
        let is_sonel = |vertex: &&Vertex| vertex.event().is_some_and(Event::leaves_sonel);
        let sonels = |path: PathView<'_>| path.vertices.iter().filter(is_sonel).count() as u64;
        let chunks: Vec<(u32, u64)> = self.chunks().collect();
        chunks.into_par_iter().map(|chunk| self.chunk_paths(chunk).map(sonels).sum::<u64>()).sum()
    }

    /// Paths stored.
    #[must_use]
    pub fn path_count(&self) -> u64 {
        self.chunks.iter().map(|chunk| u64::from(chunk.path_count)).sum()
    }

    /// The ledger of everything stored, added in chunk order.
    #[must_use]
    pub fn ledger(&self) -> Ledger {
        let mut total = Ledger::new(self.layout.bands as usize);
        for ledger in &self.ledgers {
            total.add(ledger);
        }
        total
    }

    /// The numbering of the emissions of each source.
    #[must_use]
    pub fn layout(&self) -> EmissionLayout {
        self.layout
    }

    /// Refuses a map that holds only a part of its run.
    ///
    /// # Errors
    /// [`MapError::Shard`].
    pub fn require_whole(&self) -> Result<(), MapError> {
        let ShardRange { index, count } = self.header.shard;
        if count == 1 { Ok(()) } else { Err(MapError::Shard { index, count }) }
    }

    /// Refuses a map whose file was written to since it was opened: what was read of it may be of both contents. Whoever has believed the paths asks
    /// this last.
    ///
    /// # Errors
    /// [`MapError::Changed`].
    pub fn require_unchanged(&self) -> Result<(), MapError> {
        self.bytes.require_unchanged()
    }

    /// Whether the surfaces that the paths refer to are those of `geometry`, the walls of the map's scene, and positions
    /// are about its centre. A reader that takes materials and normals from a geometry asks this first.
    ///
    /// # Errors
    /// [`MapError::ForeignSurfaces`] with the first difference.
    pub fn check_surfaces(&self, geometry: &Geometry) -> Result<(), MapError> {
        surfaces::compare(&self.surfaces, self.center, geometry)
    }

    /// Replaces the materials and sources of the scene, one each for those there are, for everything that reads energies from here on. The
    /// paths stay those drawn with the materials of the file, and weights allow for that (docs/physics.md §2).
    ///
    /// # Panics
    /// Where `materials` or `sources` are not as many as before, or a source has moved.
    pub fn change(&mut self, materials: Vec<Material>, sources: Vec<Source>) {
        let scene = &mut self.header.scene;
        assert_eq!(materials.len(), scene.materials.len(), "surfaces name their materials by number");
        let have_moved =
            sources.iter().zip(&scene.sources).any(|(one, other)| one.position != other.position);
        assert!(!have_moved && sources.len() == scene.sources.len(), "paths begin at the sources");
        let before = std::mem::replace(&mut scene.materials, materials);
        scene.sources = sources;
        self.drawn_with.get_or_insert(before);
    }

    /// Puts variants of the materials behind those of the scene, as further bands: band b of variant v is band (v + 1) B + b of B. One
    /// rendering then tells all of them from the same random numbers. Render it without edges. [`Self::narrow`] takes what is returned.
    ///
    /// # Panics
    /// Where a variant has not as many materials as the scene.
    #[must_use]
    pub fn widen(&mut self, variants: &[Vec<Material>]) -> BeforeWidening {
        let before = BeforeWidening { header: self.header.clone(), drawn_with: self.drawn_with.clone() };
        let times = variants.len() + 1;
        let scene = &mut self.header.scene;
        self.drawn_with.get_or_insert_with(|| scene.materials.clone());
        for (index, material) in scene.materials.iter_mut().enumerate() {
            for variant in variants {
                let Material { absorption, scattering, transmission, .. } = &variant[index];
                material.absorption.extend(absorption);
                material.scattering.extend(scattering);
                material.transmission.extend(transmission);
            }
        }
        scene.bands = scene.bands.repeated(times);
        scene.air_attenuation = scene.air_attenuation.repeat(times);
        for region in scene.media.iter_mut().flat_map(|media| &mut media.regions) {
            region.air_attenuation = region.air_attenuation.repeat(times);
        }
        for source in &mut scene.sources {
            source.power_level_db = source.power_level_db.repeat(times);
            if let Directivity::Measured { balloon, .. } = &mut source.directivity {
                *balloon = balloon.repeated(times);
            }
        }
        for effect in &mut self.header.effects {
            effect.on = effect.on.repeat(times);
        }
        before
    }

    /// Takes the variants away again.
    pub fn narrow(&mut self, before: BeforeWidening) {
        let BeforeWidening { header, drawn_with } = before;
        (self.header, self.drawn_with) = (header, drawn_with);
    }

    /// The materials of the file, where the scene has others by now ([`Self::change`]).
    #[must_use]
    pub fn drawn_with(&self) -> Option<&[Material]> {
        self.drawn_with.as_deref()
    }

    /// Bands that neither coefficients nor `attenuation` tell apart ([`BandClasses::alike`]).
    #[must_use]
    pub fn classes(&self, attenuation: &[f64]) -> BandClasses {
        let scene = &self.header.scene;
        if scene.media.is_some() {
            return BandClasses::separate(scene.bands.count());
        }
        BandClasses::alike(&scene.materials, &scene.sources, attenuation, self.header.settings.spectral)
    }

    /// The leads of its packets, whatever materials the scene has by now.
    #[must_use]
    pub fn leads(&self) -> Leads {
        let MapHeader { settings, scene, .. } = &self.header;
        let materials = self.drawn_with.as_deref().unwrap_or(&scene.materials);
        Leads::new(materials, &scene.variants, &scene.designs, settings.survival, settings.spectral)
    }

    /// What every event means, at walls of `materials`, to the energy of `classes` of bands, and with which probability it was drawn.
    #[must_use]
    pub fn coefficients(&self, materials: &[Material], classes: &BandClasses) -> CoefficientTable {
        CoefficientTable::grouped(materials, classes, &self.leads())
            .with_surfaces(&self.surfaces)
            .with_propagation(Propagation::of(&self.header.scene, self.center))
    }

    /// Compares every chunk with its checksum and with the rules of the layout, on all cores. `surfaces` is the number of
    /// surfaces that the caller knows.
    ///
    /// # Errors
    /// [`MapError::ForeignSurfaces`] when the map has another number of surfaces, else the first damage in file order.
    pub fn check_paths(&self, surfaces: u32) -> Result<(), MapError> {
        if self.surfaces.len() != surfaces as usize {
            let reason = format!("it has {} surfaces, here are {surfaces}", self.surfaces.len());
            return Err(MapError::ForeignSurfaces { reason });
        }
        let found: Vec<Result<(), MapError>> =
            self.chunks.par_iter().map(|chunk| self.check_chunk(chunk, surfaces)).collect();
        found.into_iter().collect()
    }

    fn check_chunk(&self, chunk: &ChunkEntry, surfaces: u32) -> Result<(), MapError> {
        let bytes = self.chunk_bytes(chunk);
        let places = Places { surfaces, media: self.header.scene.media.as_ref() };
        check_chunk(chunk, bytes, places)?;
        tiling::check_padding(self.bytes.as_slice(), chunk.offset + bytes.len() as u64)
    }

    fn chunk_bytes(&self, chunk: &ChunkEntry) -> &[u8] {
        let length = chunk.length().expect("checked when the map was opened");
        &self.bytes.as_slice()[chunk.offset as usize..(chunk.offset + length) as usize]
    }

    /// Source and first emission of every chunk, in the order of the file.
    pub fn chunks(&self) -> impl Iterator<Item = (u32, u64)> {
        self.chunks.iter().map(|chunk| (chunk.source, chunk.first_emission))
    }

    /// The paths of the chunk of `source` that begins with emission `first`, in emission order.
    pub fn chunk_paths(&self, (source, first): (u32, u64)) -> impl Iterator<Item = PathView<'_>> {
        (first..first + CHUNK_EMISSIONS).map_while(move |emission| self.path(source, emission))
    }

    /// The path of emission `emission` of `source`; [`None`] where this map does not hold it.
    #[must_use]
    pub fn path(&self, source: u32, emission: u64) -> Option<PathView<'_>> {
        let key = (source, emission - emission % CHUNK_EMISSIONS);
        let index =
            self.chunks.binary_search_by_key(&key, |chunk| (chunk.source, chunk.first_emission)).ok()?;
        let chunk = &self.chunks[index];
        let (ends, vertices) = columns(chunk, self.chunk_bytes(chunk));
        let slot = (emission % CHUNK_EMISSIONS) as usize;
        let end = *ends.get(slot)? as usize;
        let start = if slot == 0 { 0 } else { ends[slot - 1] as usize };
        Some(PathView { emission, vertices: vertices.get(start..end)? })
    }

    /// The paths of `batch` of `source` that this map holds, in emission order.
    pub fn batch_paths(&self, source: u32, batch: u32) -> impl Iterator<Item = PathView<'_>> {
        self.layout().batch_indices(batch).filter_map(move |emission| self.path(source, emission))
    }
}

/// Compares the `bytes` of `chunk` with its checksum and with the rules of the layout.
pub(crate) fn check_chunk(chunk: &ChunkEntry, bytes: &[u8], places: Places<'_>) -> Result<(), MapError> {
    let damaged = |reason: &str| MapError::Damaged { offset: chunk.offset, reason: reason.to_owned() };
    if <[u8; 32]>::from(blake3::hash(bytes)) != chunk.digest {
        return Err(damaged("a chunk of paths does not match its checksum"));
    }
    let (ends, vertices) = columns(chunk, bytes);
    let mut start = 0;
    for &end in ends {
        let path = vertices.get(start..end as usize).ok_or_else(|| damaged("paths overlap"))?;
        if !is_sound_path(path, places) {
            return Err(damaged("a path breaks the rules of the format"));
        }
        start = end as usize;
    }
    if start == vertices.len() { Ok(()) } else { Err(damaged("vertices without a path")) }
}

fn columns<'a>(chunk: &ChunkEntry, bytes: &'a [u8]) -> (&'a [u32], &'a [Vertex]) {
    let (head, vertices) = bytes.split_at(chunk.vertices_at() as usize);
    (bytemuck::cast_slice(&head[..chunk.path_count as usize * 4]), bytemuck::cast_slice(vertices))
}

/// Whether chunks and sections follow each other without gaps, as many chunks as the header says.
fn check_tiling(chunks: &[ChunkEntry], sections: &Sections<'_>, bytes: &[u8]) -> Result<(), MapError> {
    let named = &sections.header.sections;
    tiling::check_order(chunks, named, sections.header_offset, bytes.len() as u64)?;
    for section in named {
        tiling::check_padding(bytes, section.offset + section.length)?;
    }
    if sections.header.chunk_count == chunks.len() as u64 {
        return Ok(());
    }
    Err(sections.damaged("header and directory differ in the number of chunks".to_owned()))
}

/// The header with what the sections say of it.
fn read_header(sections: Sections<'_>, surfaces: &[SurfaceRow]) -> Result<MapHeader, MapError> {
    let mesh = record::mesh(sections.rows("mesh.vertices")?, sections.rows("mesh.triangles")?);
    let (directivity, media) = (sections.record(directivity::SECTION)?, sections.record(media::SECTION)?);
    let (variants, designs) = (sections.record(variants::SECTION)?, sections.record(variants::DESIGNS)?);
    let laws = sections.optional(record::LAWS)?;
    let changes = sections.optional(record::CHANGES)?;
    let air_at = sections.optional(record::AIR_AT)?;
    let gradient = sections.optional(GRADIENT)?;
    let Sections { header, header_offset, .. } = sections;
    let damaged = |reason| MapError::Damaged { offset: header_offset, reason };
    let mut header = record::header(header, mesh, directivity, laws).map_err(damaged)?;
    record::apply_changes(changes, &mut header.scene.sources).map_err(damaged)?;
    header.scene.air_at = record::read_air_at(air_at).map_err(damaged)?;
    variants::apply(variants, &mut header.scene).map_err(damaged)?;
    variants::apply_designs(designs, &mut header.scene).map_err(damaged)?;
    if let Some(record) = media {
        header.scene.media = Some(media::media(record, &header.scene, surfaces).map_err(damaged)?);
    }
    header.scene.sound_speed_gradient = read_gradient(gradient, &header.scene).map_err(damaged)?;
    Ok(header)
}

/// The gradient of the speed of sound [1/s] from the rows of its section, 0 without one.
fn read_gradient(rows: &[f64], scene: &Scene) -> Result<f64, String> {
    let is_possible = |gradient: f64| gradient != 0.0 && gradient.abs() * scene.duration <= LARGEST_TURN;
    match *rows {
        [] => Ok(0.0),
        [gradient] if scene.media.is_none() && is_possible(gradient) => Ok(gradient),
        _ => Err("the gradient of the speed of sound is out of range".to_owned()),
    }
}

fn read_ledgers(
    chunks: &[ChunkEntry],
    sections: &Sections<'_>,
    bands: usize,
) -> Result<Vec<Ledger>, MapError> {
    let fates = sections.rows::<ChunkFates>("chunk.fates")?;
    let ledgers = sections.rows::<BandLedger>("chunk.ledger")?;
    if bands == 0 || fates.len() != chunks.len() || ledgers.len() != chunks.len() * bands {
        return Err(sections.damaged("directory and ledgers differ in length".to_owned()));
    }
    if !chunks.iter().zip(fates).all(|(chunk, fates)| fates.agree_with(chunk)) {
        return Err(sections.damaged("directory and ledgers differ in paths or segments".to_owned()));
    }
    Ok(fates
        .iter()
        .zip(ledgers.chunks_exact(bands))
        .map(|(fates, bands)| Ledger {
            bands: bands.to_vec(),
            fates: Fates::from_counts(fates.fates),
            segments: fates.segments,
        })
        .collect())
}

/// The shard holds exactly the chunks it should, in order.
fn check_directory(chunks: &[ChunkEntry], header: &MapHeader) -> Result<(), MapError> {
    let layout = header.settings.layout(&header.scene);
    let held = header.shard.chunks(layout.chunks());
    let sources = header.scene.sources.len() as u64;
    let damaged = |offset, reason: &str| MapError::Damaged { offset, reason: reason.to_owned() };
    if (held.end - held.start).checked_mul(sources) != Some(chunks.len() as u64) {
        return Err(damaged(0, "the directory does not name the chunks of this run"));
    }
    let expected = (0..sources as u32)
        .flat_map(|source| held.clone().map(move |chunk| (source, chunk * CHUNK_EMISSIONS)));
    for (chunk, (source, first)) in chunks.iter().zip(expected) {
        let count = (layout.total - first).min(CHUNK_EMISSIONS);
        if (chunk.source, chunk.first_emission, u64::from(chunk.path_count)) != (source, first, count) {
            return Err(damaged(chunk.offset, "entries of the directory contradict each other"));
        }
    }
    Ok(())
}
