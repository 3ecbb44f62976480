//! Files that the fuzzer found worth keeping (fuzz/): once sealed, each reaches another place of the reader, which refuses
//! it. A find that does more than that is kept here too.

use std::collections::BTreeSet;
use std::path::Path;

use sonel_map::{MapError, SonelMap};

use crate::forged;

#[test]
fn what_the_fuzzer_found_is_refused_in_many_ways() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let mut reasons = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let mut bytes = std::fs::read(&path).unwrap();
        assert!(SonelMap::from_bytes(&bytes).is_err(), "{}", path.display());
        forged::seal(&mut bytes);
        match SonelMap::from_bytes(&bytes).expect_err(&path.display().to_string()) {
            MapError::Damaged { reason, .. } => reasons.insert(reason),
            other => reasons.insert(other.to_string()),
        };
    }
    assert!(reasons.len() >= 50, "{reasons:?}");
}
