//! Gains and delays of sources: what is written is read, and what no scene can have is refused.

use std::io::Cursor;

use sonel_acoustics::SourceChange;
use sonel_map::{MapWriter, SonelMap};

use crate::{forged, hand_made};

const SECTION: &str = "sources.changes";

/// The map of other tests, with `change` at its second source.
fn bytes(change: SourceChange) -> Vec<u8> {
    let mut header = hand_made::header(hand_made::EMISSIONS);
    header.scene.sources[1].change = change;
    let geometry = header.scene.geometry().unwrap();
    let mut writer = MapWriter::begin(Cursor::new(Vec::new())).unwrap();
    for source in 0..2 {
        let paths = hand_made::paths(&geometry, source);
        writer.push_chunk(source, 0, &paths, &hand_made::ledger(source)).unwrap();
    }
    writer.finish(&header, &geometry).unwrap().into_inner()
}

#[test]
fn a_map_carries_gains_and_delays() {
    let change = SourceChange { gain_db: -3.5, delay: 0.025 };
    let map = SonelMap::from_bytes(&bytes(change)).unwrap();
    let found: Vec<SourceChange> = map.header().scene.sources.iter().map(|source| source.change).collect();
    assert_eq!(found, [SourceChange::default(), change]);
}

#[test]
fn a_map_without_any_has_the_bytes_that_it_had() {
    assert_eq!(bytes(SourceChange::default()), hand_made::bytes());
}

#[test]
fn gains_and_delays_out_of_range_are_damage() {
    let sound = bytes(SourceChange { gain_db: -3.5, delay: 0.025 });
    for at in [0, 8, 16, 24] {
        for value in [f64::NAN, -101.0, f64::INFINITY] {
            let forged = forged::in_section(&sound, SECTION, at, &value.to_le_bytes());
            let error = SonelMap::from_bytes(&forged).expect_err("out of range").to_string();
            assert!(error.contains("gain or delay of source"), "{at} {value}: {error}");
        }
    }
}
