//! Shards joined are the run made in one piece, byte for byte; what is not of one run, or not all of it, is refused.

use std::fs::File;
use std::io::{self, Cursor};

use sonel_map::{CHUNK_EMISSIONS, MapHeader, MergeError, Merger, ShardRange, SonelMap, Spectral};

use crate::{forged, hand_made, sharded};

/// Nine chunks and a bit of each of the two sources.
const EMISSIONS: u64 = 9 * CHUNK_EMISSIONS + 100;

type Change = fn(&mut MapHeader);
const UNCHANGED: Change = |_| {};

/// Shard `index` of `count` of a run, changed by `change`.
fn shard(index: u32, count: u32, change: Change) -> Vec<u8> {
    let mut header = hand_made::header(EMISSIONS);
    header.shard = ShardRange { index, count };
    change(&mut header);
    sharded::write(&header, Cursor::new(Vec::new())).into_inner()
}

/// The maps as files named a, b, c …
struct Files {
    folder: tempfile::TempDir,
    names: Vec<String>,
}

impl Files {
    fn new(maps: &[Vec<u8>]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let name = |number: usize| char::from(b'a' + number as u8).to_string();
        for (number, bytes) in maps.iter().enumerate() {
            std::fs::write(folder.path().join(name(number)), bytes).unwrap();
        }
        Self { folder, names: (0..maps.len()).map(name).collect() }
    }

    fn open(&self, number: usize) -> io::Result<File> {
        File::open(self.folder.path().join(&self.names[number]))
    }

    fn merger(&self) -> Result<Merger, Vec<MergeError>> {
        Merger::new(&self.names, &mut |number| self.open(number))
    }
}

fn merged(maps: &[Vec<u8>]) -> Vec<u8> {
    let files = Files::new(maps);
    let merger = files.merger().unwrap();
    let mut copied = 0;
    let paths = merger.path_count();
    let mut open = |number: usize| files.open(number);
    let out = merger.write(Cursor::new(Vec::new()), &mut open, &mut |paths| copied = paths).unwrap();
    assert_eq!(copied, paths);
    out.into_inner()
}

/// All that speaks against joining `maps`.
fn problems(maps: &[Vec<u8>]) -> Vec<String> {
    Files::new(maps).merger().unwrap_err().iter().map(ToString::to_string).collect()
}

fn all_shards(count: u32, change: Change) -> Vec<Vec<u8>> {
    (1..=count).map(|index| shard(index, count, change)).collect()
}

#[test]
fn shards_joined_are_the_run_in_one_piece() {
    for count in [2, 3, 7, 10, 16] {
        assert!(merged(&all_shards(count, UNCHANGED)) == shard(1, 1, UNCHANGED), "{count} shards");
    }
}

#[test]
fn the_order_of_the_maps_does_not_matter() {
    let mut shards = all_shards(5, UNCHANGED);
    let whole = shard(1, 1, UNCHANGED);
    for _ in 0..shards.len() {
        shards.rotate_left(2);
        shards.swap(0, 1);
        assert!(merged(&shards) == whole);
    }
}

#[test]
fn runs_of_every_kind_are_joined() {
    let changes: [Change; 4] = [
        |header| header.settings.spectral = Spectral::PerBand,
        |header| header.settings.batches = 5,
        |header| header.scene.sources.truncate(1),
        |header| header.settings.emissions = 3,
    ];
    for (kind, change) in changes.into_iter().enumerate() {
        assert!(merged(&all_shards(4, change)) == shard(1, 1, change), "kind {kind}");
    }
}

#[test]
fn shards_of_different_sizes_are_joined() {
    let maps = [shard(2, 4, UNCHANGED), shard(1, 4, UNCHANGED), shard(2, 2, UNCHANGED)];
    assert!(merged(&maps) == shard(1, 1, UNCHANGED));
}

#[test]
fn some_shards_make_a_larger_one() {
    let half = merged(&[shard(4, 4, UNCHANGED), shard(3, 4, UNCHANGED)]);
    assert!(half == shard(2, 2, UNCHANGED));
    assert!(merged(&[half, shard(1, 2, UNCHANGED)]) == shard(1, 1, UNCHANGED));
}

/// The joined map is equal because every chunk is where it belongs: with two of them exchanged it is another map, which
/// no reader opens.
#[test]
fn a_map_with_two_chunks_exchanged_is_not_the_run() {
    let whole = shard(1, 1, UNCHANGED);
    let rows = forged::section(&whole, "chunks").range;
    let row = size_of::<[u64; 8]>();
    let mut exchanged = whole[rows].to_vec();
    let (first, second) = exchanged[..2 * row].split_at_mut(row);
    first.swap_with_slice(second);
    let forged = forged::in_section(&whole, "chunks", 0, &exchanged);
    assert!(forged != whole && SonelMap::from_bytes(&forged).is_err());
    assert!(SonelMap::from_bytes(&whole).is_ok());
}

#[test]
fn what_differs_is_named_with_both_values() {
    let changes: [(Change, &str); 6] = [
        (|header| header.settings.seed = 12, "b: seed is 12, but 11 in a"),
        (
            |header| header.tool_version = "0.9+2.ab".to_owned(),
            "b: version of sonel is 0.9+2.ab, but by hand in a",
        ),
        (|header| header.scene.digest = [3; 32], "b: scene file (its digest) is 0303"),
        (
            |header| header.scene.materials[1].absorption[2] = 0.25,
            "b: absorption of material \"floor\" is 0.5, 0.5, 0.25, but 0.5, 0.5, 0.5 in a",
        ),
        (|header| header.effects[0].on[0] = true, "b: effect air is on, on, on"),
        (|header| header.scene.mesh.vertices[0].x += 0.25, "b: mesh is 12 triangles with digest"),
    ];
    for (change, message) in changes {
        let found = problems(&[shard(1, 2, UNCHANGED), shard(2, 2, change)]);
        assert!(found.len() == 1 && found[0].starts_with(message), "{message}: {found:?}");
    }
}

#[test]
fn all_problems_are_named_at_once() {
    let other: Change = |header| {
        header.settings.seed = 12;
        header.settings.batches = 3;
    };
    let mut damaged = shard(3, 4, UNCHANGED);
    damaged.truncate(1000);
    let found = problems(&[shard(1, 4, UNCHANGED), shard(2, 4, other), damaged, b"no map".to_vec()]);
    assert_eq!(found.len(), 4, "{found:?}");
    for (found, part) in
        found.iter().zip(["b: seed", "b: number of batches", "c: ", "d: this is not a sonel"])
    {
        assert!(found.starts_with(part), "{found}");
    }
    // Seeds do not decide who holds what.
    let found = problems(&[shard(1, 4, UNCHANGED), shard(3, 4, other)]);
    assert!(found.iter().any(|problem| problem.contains("shard 2/4")), "{found:?}");
}

#[test]
fn overlaps_and_gaps_are_named() {
    let found = problems(&[shard(1, 4, UNCHANGED), shard(1, 4, UNCHANGED), shard(4, 4, UNCHANGED)]);
    assert_eq!(
        found,
        [
            "a and b both hold emissions 0 to 1023 of every source: leave one out",
            "emissions 1024 to 3583 of every source are missing (shards 2/4 to 3/4): trace them, or add the map that \
             holds them",
        ]
    );
    let found = problems(&[shard(1, 2, UNCHANGED), shard(2, 3, UNCHANGED)]);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].contains("both hold emissions 1536 to 2559"), "{found:?}");
    assert!(found[1].contains("emissions 3072 to 4707 of every source are missing: "), "{found:?}");
}

#[test]
fn shards_that_make_no_shard_want_the_rest() {
    let found = problems(&[shard(2, 5, UNCHANGED), shard(3, 5, UNCHANGED)]);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].contains("(shard 1/5)") && found[1].contains("(shards 4/5 to 5/5)"), "{found:?}");
}

#[test]
fn no_map_is_nothing_to_join() {
    assert!(matches!(&Files::new(&[]).merger().unwrap_err()[..], [MergeError::TooFew]));
}

#[test]
fn maps_of_a_later_minor_version_are_not_copied_in_part() {
    let mut later = shard(2, 2, UNCHANGED);
    later[10] = 1;
    forged::seal(&mut later);
    let found = problems(&[shard(1, 2, UNCHANGED), later]);
    assert!(found.len() == 1 && found[0].contains("format version 1.1"), "{found:?}");
}

#[test]
fn a_flipped_bit_of_a_chunk_ends_the_copy() {
    let sound = [shard(1, 2, UNCHANGED), shard(2, 2, UNCHANGED)];
    let copied = |maps: &[Vec<u8>]| {
        let files = Files::new(maps);
        let merger = files.merger().unwrap();
        merger.write(Cursor::new(Vec::new()), &mut |number| files.open(number), &mut |_| {})
    };
    assert!(copied(&sound).is_ok());
    // The ends, the vertices and the padding of chunks.
    for at in [70, 5000, 3 * 64 + 2048 + 16 * 1023] {
        let mut maps = sound.clone();
        maps[1][at] ^= 2;
        let error = copied(&maps).unwrap_err().to_string();
        assert!(error.starts_with("b: the map is damaged at byte"), "byte {at}: {error}");
    }
}
