//! The seeds of the fuzz targets (`fuzz/seeds`): each is read, and whatever is cut off, flipped, swapped or repeated in it is read or refused.

use std::path::{Path, PathBuf};

#[path = "../../fuzz/readers.rs"]
mod fuzzed;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a folder of the workspace")
}

/// Seeds of a reader: the name of the file, and its bytes.
fn seeds(reader: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = root().join("fuzz/seeds").join(reader);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.map(|path| (path.clone(), std::fs::read(path).expect("a seed"))).collect()
}

/// A random number below `end`, by the multiplier of Knuth's MMIX.
fn below(state: &mut u64, end: usize) -> usize {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*state >> 33) as usize) % end.max(1)
}

/// A copy with one kind of damage.
fn damaged(seed: &[u8], state: &mut u64) -> Vec<u8> {
    let mut copy = seed.to_vec();
    let (a, b) = (below(state, copy.len()), below(state, copy.len()));
    let length = 1 + below(state, 32);
    match below(state, 5) {
        0 => copy.truncate(a),
        1 => copy[a] ^= 1 << below(state, 8),
        2 => copy.swap(a, b),
        3 => copy[a] = [0, 0x7f, 0x80, 0xff, b'9'][below(state, 5)],
        _ => {
            let end = copy.len().min(b + length);
            let again = copy[b.min(end)..end].to_vec();
            copy.splice(a..a, again);
        }
    }
    copy
}

#[test]
fn seeds_are_read_and_their_damaged_copies_never_panic() {
    let mut state = 1;
    for (name, reader) in fuzzed::READERS {
        let seeds = seeds(name);
        assert!(!seeds.is_empty(), "{name}");
        for (path, seed) in seeds {
            assert!(reader(&seed), "{} is refused", path.display());
            for _ in 0..crate::COPIES {
                fuzzed::read(name, &damaged(&seed, &mut state));
            }
        }
    }
}
