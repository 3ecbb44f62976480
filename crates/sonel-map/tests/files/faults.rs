//! Whatever is wrong with a file is an error that says so: no panic, no wrong paths.

use std::fs::File;
use std::io::Write;

use sonel_map::{BandClasses, Emissions, MapError, PathWeight, SonelMap};

use crate::{forged, hand_made};

/// Surfaces of the box.
const SURFACES: u32 = 6;

/// What a careful reader does first.
fn read(bytes: &[u8]) -> Result<SonelMap, MapError> {
    let map = SonelMap::from_bytes(bytes)?;
    map.check_surfaces(&hand_made::scene().geometry()?)?;
    map.check_paths(SURFACES)?;
    Ok(map)
}

/// Reads everything that an open map offers, checked or not, so that a panic comes to light.
fn touch(map: &SonelMap) {
    let _ = (map.ledger(), map.vertex_count(), map.path_count(), map.require_whole());
    let Ok(()) = map.check_paths(SURFACES) else { return };
    let classes = BandClasses::separate(map.header().scene.bands.count());
    let emissions = Emissions::of_map(map, map.header().scene.geometry().unwrap().center(), &classes);
    let table = map.coefficients(&map.header().scene.materials, &classes);
    let mut weight = PathWeight::of(&table);
    for chunk in map.chunks() {
        for path in map.chunk_paths(chunk) {
            let mut sonels = 0;
            emissions.follow(chunk.0, path, 1.0, &table, &mut weight, |segment| {
                sonels += usize::from(segment.arrival.is_some());
            });
            assert!(sonels <= path.vertices.len());
        }
    }
}

/// Where the settings begin: behind the version of the tool, the first field of the header.
fn settings_at(bytes: &[u8]) -> usize {
    let header = forged::header_range(bytes).start;
    header + 8 + u64::from_le_bytes(bytes[header..header + 8].try_into().unwrap()) as usize
}

fn file_of(bytes: &[u8]) -> File {
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file
}

#[test]
fn the_sound_map_is_read() {
    let bytes = hand_made::bytes();
    let map = read(&bytes).unwrap();
    assert_eq!(map.path_count(), 2 * hand_made::EMISSIONS);
    touch(&map);
    assert_eq!(SonelMap::open(&file_of(&bytes)).unwrap().digest(), map.digest());
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    let bytes = hand_made::bytes();
    for length in 0..bytes.len() {
        let error = read(&bytes[..length]).expect_err("a part is no map");
        let said = if length < 8 {
            matches!(error, MapError::NotAMap)
        } else {
            matches!(error, MapError::Truncated { .. })
        };
        assert!(said, "{length} bytes: {error}");
    }
}

#[test]
fn a_file_with_bytes_behind_its_end_is_refused() {
    let mut bytes = hand_made::bytes();
    bytes.push(0);
    assert!(matches!(read(&bytes), Err(MapError::Damaged { .. })));
}

#[test]
fn every_flipped_bit_is_found() {
    let mut bytes = hand_made::bytes();
    for bit in 0..bytes.len() * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(read(&bytes).is_err(), "byte {}, bit {}", bit / 8, bit % 8);
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

/// The checksums are what finds a flipped bit in a position: made to fit, the same bit passes.
#[test]
fn a_flipped_bit_with_a_forged_checksum_is_not_found() {
    let sound = hand_made::bytes();
    let chunk = forged::section(&sound, "chunks").range;
    let at = u64::from_le_bytes(sound[chunk.start + 24..chunk.start + 32].try_into().unwrap()) as usize;
    let mut flipped = sound;
    flipped[at + 64] ^= 1;
    assert!(read(&flipped).is_err());
    let length = 64 + 28 * 16;
    let digest = blake3::hash(&flipped[at..at + length]);
    let forged = forged::in_section(&flipped, "chunks", 32, digest.as_bytes());
    read(&forged).unwrap();
}

#[test]
fn what_is_no_map_is_said_to_be_none() {
    let folder = tempfile::tempdir().unwrap();
    let not_a_map = |file: &File| matches!(SonelMap::open(file), Err(MapError::NotAMap));
    assert!(not_a_map(&file_of(b"")));
    assert!(not_a_map(&file_of(b"SONELMA")));
    assert!(not_a_map(&file_of(&[0; 4096])));
    assert!(not_a_map(&file_of(b"name = \"Hall\"\nshoebox = [5.0, 4.0, 3.0]\n")));
    #[cfg(unix)]
    for path in [folder.path(), std::path::Path::new("/dev/null")] {
        assert!(not_a_map(&File::open(path).unwrap()), "{}", path.display());
    }
}

#[test]
fn versions_are_told_apart() {
    let sound = hand_made::bytes();
    for major in [0_u16, 2, u16::MAX] {
        let mut other = sound.clone();
        other[8..10].copy_from_slice(&major.to_le_bytes());
        forged::seal(&mut other);
        let error = read(&other).unwrap_err();
        assert!(matches!(error, MapError::UnsupportedVersion { major: found, .. } if found == major));
    }
}

#[test]
fn a_later_minor_version_may_add_fields_to_the_header_and_this_one_may_not() {
    let mut bytes = hand_made::bytes();
    bytes.extend([0xAB; 24]);
    let longer = (forged::header_range(&bytes).len() + 24) as u64;
    bytes[24..32].copy_from_slice(&longer.to_le_bytes());
    forged::seal(&mut bytes);
    assert!(matches!(read(&bytes), Err(MapError::Damaged { .. })));
    bytes[10..12].copy_from_slice(&1_u16.to_le_bytes());
    forged::seal(&mut bytes);
    read(&bytes).unwrap();
}

#[test]
fn a_run_that_was_stopped_leaves_an_incomplete_map() {
    let header = hand_made::header(hand_made::EMISSIONS);
    let geometry = header.scene.geometry().unwrap();
    let mut bytes = Vec::new();
    let mut writer = sonel_map::MapWriter::begin(std::io::Cursor::new(&mut bytes)).unwrap();
    writer.push_chunk(0, 0, &hand_made::paths(&geometry, 0), &hand_made::ledger(0)).unwrap();
    drop(writer);
    assert!(matches!(read(&bytes), Err(MapError::Incomplete)));
}

/// A disk with room for so many bytes.
struct SmallDisk {
    room: usize,
    bytes: std::io::Cursor<Vec<u8>>,
}

impl Write for SmallDisk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        if self.bytes.position() as usize + bytes.len() > self.room {
            return Err(std::io::ErrorKind::StorageFull.into());
        }
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl std::io::Seek for SmallDisk {
    fn seek(&mut self, position: std::io::SeekFrom) -> std::io::Result<u64> {
        self.bytes.seek(position)
    }
}

#[test]
fn a_full_disk_is_an_error_of_the_writer_wherever_it_strikes() {
    let header = hand_made::header(hand_made::EMISSIONS);
    let geometry = header.scene.geometry().unwrap();
    let whole = hand_made::bytes().len();
    let write = |room| -> Result<usize, MapError> {
        let disk = SmallDisk { room, bytes: std::io::Cursor::new(Vec::new()) };
        let mut writer = sonel_map::MapWriter::begin(disk)?;
        for source in 0..2 {
            writer.push_chunk(source, 0, &hand_made::paths(&geometry, source), &hand_made::ledger(source))?;
        }
        Ok(writer.finish(&header, &geometry)?.bytes.into_inner().len())
    };
    for room in (0..whole).step_by(7).chain([whole - 1]) {
        let error = write(room).expect_err("no room");
        assert!(
            matches!(&error, MapError::Io(io) if io.kind() == std::io::ErrorKind::StorageFull),
            "{error}"
        );
    }
    assert_eq!(write(whole).unwrap(), whole);
}

#[test]
fn a_map_without_paths_is_a_map() {
    let writer = sonel_map::MapWriter::begin(std::io::Cursor::new(Vec::new())).unwrap();
    let bytes =
        writer.finish(&hand_made::header(0), &hand_made::scene().geometry().unwrap()).unwrap().into_inner();
    let map = read(&bytes).unwrap();
    assert_eq!((map.path_count(), map.vertex_count(), map.ledger().segments), (0, 0, 0));
    assert!(map.path(0, 0).is_none() && map.batch_paths(0, 1).next().is_none());
}

#[test]
fn a_run_with_chunks_missing_is_refused() {
    let writer = sonel_map::MapWriter::begin(std::io::Cursor::new(Vec::new())).unwrap();
    let bytes =
        writer.finish(&hand_made::header(1), &hand_made::scene().geometry().unwrap()).unwrap().into_inner();
    assert!(matches!(read(&bytes), Err(MapError::Damaged { .. })));
}

#[test]
fn settings_that_cannot_be_are_refused() {
    let sound = hand_made::bytes();
    let settings = settings_at(&sound);
    let (max, nan) = (u64::MAX.to_le_bytes(), f64::NAN.to_le_bytes());
    let cases: [(&str, usize, &[u8]); 9] = [
        ("emissions", 0, &max),
        ("no batches", 16, &[0; 4]),
        ("batches", 16, &max[..4]),
        ("spectral", 20, &[2, 0, 0, 0]),
        ("mode", 24, &[2, 0, 0, 0]),
        ("shard 0", 28, &[0; 4]),
        ("shard 1 of 0", 32, &[0; 4]),
        ("chunk_emissions", 36, &max),
        ("survival", 44, &nan),
    ];
    for (name, at, value) in cases {
        let forged = forged::in_header(&sound, settings + at, value);
        assert!(matches!(read(&forged), Err(MapError::Damaged { .. })), "{name}");
    }
}

#[test]
fn effects_that_this_version_does_not_know_are_refused() {
    let valid = hand_made::bytes();
    let name = valid.windows(3).position(|bytes| bytes == b"air").expect("the name of an effect");
    let error = read(&forged::in_header(&valid, name, b"ear")).expect_err("no such effect");
    assert!(error.to_string().contains("effect \"ear\""), "{error}");
}

#[test]
fn sections_must_be_where_they_belong() {
    let sound = hand_made::bytes();
    for name in ["mesh.vertices", "mesh.triangles", "surfaces", "chunks", "chunk.fates", "chunk.ledger"] {
        let stated_at = forged::section(&sound, name).stated_at;
        for value in [0, 1, 63, 64, 1 << 40, u64::MAX] {
            for field in [0, 8] {
                let forged = forged::in_header(&sound, stated_at + field, &u64::to_le_bytes(value));
                let error = read(&forged).expect_err(name);
                assert!(matches!(error, MapError::Damaged { .. } | MapError::Truncated { .. }), "{error}");
            }
        }
        let forged = forged::in_header(&sound, stated_at - 1, b"?");
        assert!(read(&forged).is_err(), "{name} renamed");
    }
}

/// Every place of the header holds every absurd number once, with checksums that fit.
#[test]
fn no_number_in_the_header_makes_the_reader_panic() {
    let sound = hand_made::bytes();
    let header = forged::header_range(&sound);
    for at in header.start..header.end - 8 {
        for value in forged::ABSURD {
            if let Ok(map) = SonelMap::from_bytes(&forged::in_header(&sound, at, &value.to_le_bytes())) {
                touch(&map);
            }
        }
    }
}

#[test]
fn no_number_in_a_section_makes_the_reader_panic() {
    let sound = hand_made::bytes();
    for name in ["mesh.vertices", "mesh.triangles", "surfaces", "chunks", "chunk.fates", "chunk.ledger"] {
        let length = forged::section(&sound, name).range.len();
        for at in (0..=length - 8).step_by(4) {
            for value in forged::ABSURD {
                let forged = forged::in_section(&sound, name, at, &value.to_le_bytes());
                if let Ok(map) = SonelMap::from_bytes(&forged) {
                    touch(&map);
                }
            }
        }
    }
}

#[test]
fn surfaces_of_another_geometry_are_refused() {
    let sound = hand_made::bytes();
    // The material of surface 0, which is the other one.
    let forged = forged::in_section(&sound, "surfaces", 0, &1_u32.to_le_bytes());
    assert!(matches!(read(&forged), Err(MapError::ForeignSurfaces { .. })));
    let map = read(&sound).unwrap();
    assert!(matches!(map.check_paths(SURFACES + 1), Err(MapError::ForeignSurfaces { .. })));
}

/// A mapped file is written to after its paths were believed: shorter within its last page, where zeros are read, and of another content.
#[test]
fn a_file_that_is_written_to_while_it_is_open_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = hand_made::bytes();
    let longer = [bytes.clone(), vec![0; 64]].concat();
    for (index, after) in
        [&bytes[..bytes.len() - 40], &longer, &bytes.iter().rev().copied().collect::<Vec<_>>()]
            .into_iter()
            .enumerate()
    {
        let path = folder.path().join(format!("{index}.sonelmap"));
        std::fs::write(&path, &bytes).unwrap();
        let map = SonelMap::open(&File::open(&path).unwrap()).unwrap();
        map.check_paths(SURFACES).unwrap();
        map.require_unchanged().unwrap();
        // Clocks of file systems tick some hundred times a second.
        std::thread::sleep(std::time::Duration::from_millis(20));
        File::options().write(true).truncate(false).open(&path).unwrap().write_all(after).unwrap();
        File::options().write(true).open(&path).unwrap().set_len(after.len() as u64).unwrap();
        assert!(matches!(map.require_unchanged(), Err(MapError::Changed)), "{index}");
    }
    let path = folder.path().join("replaced.sonelmap");
    std::fs::write(&path, &bytes).unwrap();
    let map = SonelMap::open(&File::open(&path).unwrap()).unwrap();
    std::fs::write(folder.path().join("new"), &longer).unwrap();
    std::fs::rename(folder.path().join("new"), &path).unwrap();
    map.require_unchanged().unwrap();
}
