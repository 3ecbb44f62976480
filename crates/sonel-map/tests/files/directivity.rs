//! Maps with measured directivities: what is written is read, and what cannot be is refused.

use std::io::Cursor;

use glam::DVec3;
use sonel_acoustics::{Balloon, Directivity, Pattern};
use sonel_map::provenance::differences;
use sonel_map::{MapError, MapHeader, MapWriter, SonelMap};

use crate::{forged, hand_made};

fn balloon(tilt: f64) -> Balloon {
    let energies = (0..4 * 3 * 3).map(|node| 1.0 + tilt * f64::from(node % 7)).collect();
    Balloon::new("horn.csv", [4, 3, 3], energies).unwrap()
}

/// The box of other tests, whose first source and only receiver are directional.
fn header() -> MapHeader {
    let mut header = hand_made::header(2);
    let source = &mut header.scene.sources[0];
    source.directivity = Directivity::measured(balloon(0.3), source.aim, DVec3::new(1.0, 2.0, 0.5)).unwrap();
    header.scene.receivers[0].pattern = Pattern::Supercardioid;
    header
}

fn bytes(header: &MapHeader) -> Vec<u8> {
    let geometry = header.scene.geometry().unwrap();
    let mut writer = MapWriter::begin(Cursor::new(Vec::new())).unwrap();
    for source in 0..2 {
        let paths = hand_made::paths(&geometry, source);
        writer.push_chunk(source, 0, &paths, &hand_made::ledger(source)).unwrap();
    }
    writer.finish(header, &geometry).unwrap().into_inner()
}

#[test]
fn a_map_carries_the_table() {
    let header = MapHeader { scene: header().scene, ..hand_made::header(hand_made::EMISSIONS) };
    let bytes = bytes(&header);
    let map = SonelMap::from_bytes(&bytes).unwrap();
    assert_eq!(map.header().scene, header.scene);
    let mut other = header;
    assert!(differences(map.header(), &other).is_empty());
    let source = &mut other.scene.sources[0];
    source.directivity = Directivity::measured(balloon(0.31), source.aim, DVec3::X).unwrap();
    other.scene.receivers[0].pattern = Pattern::Cardioid;
    assert_eq!(differences(map.header(), &other).len(), 2);
    // Bands of a measured directivity are told apart, and so are those of variants.
    assert_eq!(map.classes(&[0.0; 3]).count(), 3);
}

#[test]
fn no_number_among_the_directivities_makes_the_reader_panic() {
    let header = MapHeader { scene: header().scene, ..hand_made::header(hand_made::EMISSIONS) };
    let sound = bytes(&header);
    let length = forged::section(&sound, "directivity").range.len();
    let mut refused = 0;
    for at in 0..=length - 8 {
        for value in forged::ABSURD {
            let forged = forged::in_section(&sound, "directivity", at, &value.to_le_bytes());
            refused += usize::from(SonelMap::from_bytes(&forged).is_err());
        }
    }
    assert!(refused > length, "{refused} of {length}");
    // Name, its length, number of balloons, azimuths and polars, number of factors: then the first factor.
    let first = 8 + 8 + "horn.csv".len() + 4 + 4 + 8;
    let forged = forged::in_section(&sound, "directivity", first, &(-1.0_f64).to_le_bytes());
    assert!(matches!(SonelMap::from_bytes(&forged), Err(MapError::Damaged { .. })));
}
