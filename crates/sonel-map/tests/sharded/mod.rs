//! Maps of many chunks, made by hand: what a chunk holds depends on source and emissions alone.

use std::io::{Seek, Write};

use glam::Vec3;
use sonel_geometry::{Geometry, Side};
use sonel_map::{
    BandLedger, CHUNK_EMISSIONS, ChunkPaths, Event, Fates, Ledger, MapHeader, MapWriter, Vertex,
};

/// Path of an emission: one to three vertices whose places tell source and emission.
fn paths(geometry: &Geometry, source: u32, emissions: std::ops::Range<u64>) -> ChunkPaths {
    let mut paths = ChunkPaths::default();
    for emission in emissions {
        let place = Vec3::new(source as f32, emission as f32, 0.5);
        let surface = geometry.triangle_surface((emission % 12) as u32);
        for _ in 0..emission % 3 {
            paths.vertices.push(Vertex::new(place, surface, Side::Front, Event::Diffuse));
        }
        paths.vertices.push(Vertex::new(place, surface, Side::Back, Event::Absorbed));
        paths.ends.push(paths.vertices.len() as u32);
    }
    paths
}

/// A ledger whose sum depends on the order of addition.
fn ledger(paths: &ChunkPaths, first: u64) -> Ledger {
    let mut ledger = Ledger::new(3);
    for (index, band) in ledger.bands.iter_mut().enumerate() {
        let number = (first / CHUNK_EMISSIONS + 1) as f64;
        *band = BandLedger::from_terms(std::array::from_fn(|term| {
            (term + index + 1) as f64 / (number * number * number)
        }));
    }
    ledger.fates = Fates::from_counts([paths.ends.len() as u64, 0, 0, 0, 0]);
    ledger.segments = paths.vertices.len() as u64;
    ledger
}

/// Writes the shard that `header` names to `out`.
pub(crate) fn write<W: Write + Seek>(header: &MapHeader, out: W) -> W {
    let geometry = header.scene.geometry().unwrap();
    let total = header.settings.layout(&header.scene).total;
    let mut writer = MapWriter::begin(out).unwrap();
    for source in 0..header.scene.sources.len() as u32 {
        for chunk in header.shard.chunks(total.div_ceil(CHUNK_EMISSIONS)) {
            let first = chunk * CHUNK_EMISSIONS;
            let paths = paths(&geometry, source, first..(first + CHUNK_EMISSIONS).min(total));
            writer.push_chunk(source, first, &paths, &ledger(&paths, first)).unwrap();
        }
    }
    writer.finish(header, &geometry).unwrap()
}
