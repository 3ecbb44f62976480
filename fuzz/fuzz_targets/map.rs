//! A map of any bytes opens or is refused. All digests are made to fit first: otherwise nothing behind them is
//! ever reached. What is believed is read to the end: every path is swept, with its edges.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sonel_geometry::Geometry;
use sonel_map::{BandClasses, Emissions, PathWeight, SonelMap};

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    seal(&mut bytes);
    let Ok(map) = SonelMap::from_bytes(&bytes) else { return };
    let _ = (map.ledger(), map.path_count(), map.vertex_count(), map.require_whole());
    if let Ok(geometry) = map.header().scene.geometry() {
        let believed = map.check_surfaces(&geometry).is_ok()
            && map.check_paths(geometry.surfaces().len() as u32).is_ok();
        if believed {
            read(&map, &geometry);
        }
    }
});

/// Sweeps every path, as all readers do.
fn read(map: &SonelMap, geometry: &Geometry) {
    if map.header().settings.batches > 64 {
        return;
    }
    let classes = BandClasses::separate(map.header().scene.bands.count());
    let emissions = Emissions::of_map(map, geometry.center(), &classes);
    let table = map.coefficients(&classes);
    let mut weight = PathWeight::of(&table);
    for chunk in map.chunks() {
        for path in map.chunk_paths(chunk) {
            emissions.follow(chunk.0, path, 1.0, &table, &mut weight, |segment| {
                assert!(segment.energy.iter().all(|lanes| lanes.map(|energy: f64| energy.min(0.0)).sum() >= 0.0));
            });
        }
    }
}

/// Sections whose digests the header states behind their names (docs/formats/sonelmap.md).
const SECTIONS: [&str; 7] =
    ["mesh.vertices", "mesh.triangles", "surfaces", "chunks", "chunk.fates", "chunk.ledger", "edges"];

/// Makes all digests fit: of the chunks in their directory, of the sections in the header, of the header itself.
fn seal(bytes: &mut [u8]) {
    let Some(header) = range(bytes, 16) else { return };
    for name in SECTIONS {
        let text = [&(name.len() as u64).to_le_bytes(), name.as_bytes()].concat();
        let Some(found) = bytes[header.clone()].windows(text.len()).position(|window| window == text) else {
            continue;
        };
        let stated_at = header.start + found + text.len();
        let Some(section) = range(bytes, stated_at) else { continue };
        if name == "chunks" {
            seal_chunks(bytes, section.clone());
        }
        let digest = blake3::hash(&bytes[section]);
        write(bytes, stated_at + 16, digest.as_bytes());
    }
    let digest = blake3::Hasher::new().update(&bytes[..32]).update(&bytes[header]).finalize();
    write(bytes, 32, digest.as_bytes());
}

/// Writes the digest of every chunk into its row of 64 bytes.
fn seal_chunks(bytes: &mut [u8], directory: std::ops::Range<usize>) {
    for row in directory.step_by(64) {
        let Some([paths, vertices, offset]) = number(bytes, row)
            .zip(number(bytes, row + 16))
            .zip(number(bytes, row + 24))
            .map(|((a, b), c)| [a >> 32, b, c])
        else {
            return;
        };
        let length = (paths * 4).next_multiple_of(64).checked_add(vertices.saturating_mul(16));
        let end = length.and_then(|length| offset.checked_add(length));
        let Some(chunk) = end.and_then(|end| bytes.get(offset..end)) else { continue };
        let digest = blake3::hash(chunk);
        write(bytes, row + 32, digest.as_bytes());
    }
}

fn number(bytes: &[u8], at: usize) -> Option<usize> {
    let number = bytes.get(at..at.checked_add(8)?)?;
    number.try_into().ok().map(u64::from_le_bytes).map(|number| number as usize)
}

/// The bytes whose offset and length stand at `at`.
fn range(bytes: &[u8], at: usize) -> Option<std::ops::Range<usize>> {
    let (offset, length) = (number(bytes, at)?, number(bytes, at + 8)?);
    let end = offset.checked_add(length).filter(|end| *end <= bytes.len())?;
    Some(offset..end)
}

fn write(bytes: &mut [u8], at: usize, value: &[u8]) {
    if let Some(place) = bytes.get_mut(at..at + value.len()) {
        place.copy_from_slice(value);
    }
}
