//! A map of any bytes opens or is refused. The digest of the header is made to fit first: otherwise nothing behind it is
//! ever reached.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sonel_map::SonelMap;

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    seal(&mut bytes);
    let Ok(map) = SonelMap::from_bytes(&bytes) else { return };
    let _ = (map.ledger(), map.path_count(), map.vertex_count(), map.require_whole());
    if let Ok(geometry) = map.header().scene.geometry() {
        let _ = map.check_surfaces(&geometry);
        let _ = map.check_paths(geometry.surfaces().len() as u32);
    }
});

/// Writes the digest of preamble and header where it belongs (docs/formats/sonelmap.md).
fn seal(bytes: &mut [u8]) {
    let Some(numbers) = bytes.get(16..32) else { return };
    let number = |range: std::ops::Range<usize>| {
        numbers[range].try_into().map(u64::from_le_bytes).unwrap_or_default() as usize
    };
    let (offset, length) = (number(0..8), number(8..16));
    let Some(header) = offset.checked_add(length).and_then(|end| bytes.get(offset..end)) else { return };
    let digest = blake3::Hasher::new().update(&bytes[..32]).update(header).finalize();
    if let Some(place) = bytes.get_mut(32..64) {
        place.copy_from_slice(digest.as_bytes());
    }
}
