//! No number in a file makes the reader allocate more than the file is worth, whatever its checksums say.
//!
//! A binary of its own with one test: what it measures is the memory of the whole process.
#![allow(clippy::unwrap_used, reason = "the functions that tests share are no #[test] themselves")]

mod forged;
mod hand_made;

use std::fs::File;
use std::io::{Seek, Write};

use peak_alloc::PeakAlloc;
use sonel_map::SonelMap;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Most memory held at once while opening `file` [bytes].
fn memory_to_open(file: &File) -> usize {
    let before = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    drop(SonelMap::open(file));
    ALLOCATOR.peak_usage() - before
}

#[test]
fn lengths_in_a_forged_file_allocate_no_more_than_the_file_holds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("forged.sonelmap");
    let mut written = File::create(&path).unwrap();
    let mut memory_of = |bytes: &[u8]| {
        // Every file is as long as the one before and written over it: to begin anew would wait for the disk each time.
        written.rewind().unwrap();
        written.write_all(bytes).unwrap();
        memory_to_open(&File::open(&path).unwrap())
    };
    let sound = hand_made::bytes();
    // The header as records (four times its bytes) and its sums, beside copies of directory and mesh.
    let allowed = 4 * sound.len();
    let memory = memory_of(&sound);
    assert!((sound.len() / 4..allowed).contains(&memory), "{memory}");
    let header = forged::header_range(&sound);
    for at in header.start..header.end - 8 {
        for value in [1 << 10, 1 << 14, 1 << 20, 1 << 24, 1 << 40, u64::MAX] {
            let memory = memory_of(&forged::in_header(&sound, at, &value.to_le_bytes()));
            assert!(memory <= allowed, "{value} at byte {at} of the header: {memory} bytes");
        }
    }
    let chunks = forged::section(&sound, "chunks").range.len();
    for at in (0..=chunks - 8).step_by(4) {
        for value in forged::ABSURD {
            let memory = memory_of(&forged::in_section(&sound, "chunks", at, &value.to_le_bytes()));
            assert!(memory <= allowed, "{value} at byte {at} of the directory: {memory} bytes");
        }
    }
}
