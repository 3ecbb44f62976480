//! Joining takes memory for directories and ledgers, not for paths.
//!
//! A binary of its own with one test: what it measures is the memory of the whole process.
#![allow(clippy::unwrap_used, reason = "the functions that tests share are no #[test] themselves")]

#[expect(dead_code, reason = "other tests need the whole map")]
mod hand_made;
mod sharded;

use std::fs::File;
use std::io::BufWriter;

use peak_alloc::PeakAlloc;
use sonel_map::{CHUNK_EMISSIONS, Merger, ShardRange};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Most memory held at once while two halves of a run of `chunks` chunks of each of two sources are joined, and the length of the
/// result [bytes].
fn memory_and_length(chunks: u64) -> (usize, u64) {
    let folder = tempfile::tempdir().unwrap();
    let names = ["1", "2"].map(|name| folder.path().join(name).display().to_string());
    for (index, name) in (1..).zip(&names) {
        let mut header = hand_made::header(chunks * CHUNK_EMISSIONS);
        header.shard = ShardRange { index, count: 2 };
        sharded::write(&header, BufWriter::new(File::create(name).unwrap()));
    }
    let out = File::create(folder.path().join("out")).unwrap();
    let before = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let mut open = |number: usize| File::open(&names[number]);
    let merger = Merger::new(&names, &mut open).unwrap();
    let out = merger.write(out, &mut open, &mut |_| {}).unwrap();
    (ALLOCATOR.peak_usage() - before, out.metadata().unwrap().len())
}

#[test]
fn memory_grows_by_rows_not_by_chunks() {
    let ((few, short), (many, long)) = (memory_and_length(20), memory_and_length(220));
    let chunks = 2 * 200;
    // Directory, ledgers and their columns of three bands, with room to grow into: not a tenth of a chunk of short paths.
    assert!((many - few) / chunks < 1500, "{} bytes a chunk", (many - few) / chunks);
    assert!((long - short) / chunks as u64 > 15_000, "{} bytes a chunk", (long - short) / chunks as u64);
}
