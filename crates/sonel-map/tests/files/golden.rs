//! A map of format 1.0 is kept in the repository: whatever is written in it must stay readable, number by number.

use std::path::PathBuf;

use sonel_map::SonelMap;

use crate::hand_made;

/// The identity of the golden map.
const DIGEST: &str = "7bd626a9d29fa2627da4bbe3b1bb72c9436960ef68df7cb17753b8243b7771bc";

fn golden() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden/box-1.0.sonelmap")
}

#[test]
fn the_golden_map_opens_with_everything_in_it() {
    let file = std::fs::File::open(golden()).unwrap();
    let map = SonelMap::open(&file).unwrap();
    let expected = hand_made::header(hand_made::EMISSIONS);
    let header = map.header();
    assert_eq!(header.tool_version, expected.tool_version);
    assert_eq!(header.settings, expected.settings);
    assert_eq!(header.shard, expected.shard);
    assert_eq!(header.effects, expected.effects);
    assert_eq!(header.scene, expected.scene);
    let geometry = header.scene.geometry().unwrap();
    map.check_surfaces(&geometry).unwrap();
    map.check_paths(geometry.surfaces().len() as u32).unwrap();
    let mut ledger = hand_made::ledger(0);
    ledger.add(&hand_made::ledger(1));
    assert_eq!(map.ledger(), ledger);
    for source in 0..2 {
        let written = hand_made::paths(&geometry, source);
        let mut start = 0;
        for (emission, &end) in written.ends.iter().enumerate() {
            let path = map.path(source, emission as u64).unwrap();
            assert_eq!(path.vertices, &written.vertices[start..end as usize]);
            start = end as usize;
        }
    }
    let digest: String = map.digest().iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(digest, DIGEST);
}

/// A change of the layout shows here. Before 1.0 is released the file may be written anew, by
/// `cargo test -p sonel-map --test files -- --ignored golden`; afterwards a new version gets a file of its own.
#[test]
fn the_writer_still_writes_the_golden_bytes() {
    assert!(std::fs::read(golden()).unwrap() == hand_made::bytes(), "the layout has changed");
}

#[test]
#[ignore = "writes the golden file"]
fn write_the_golden_file() {
    std::fs::write(golden(), hand_made::bytes()).unwrap();
}
