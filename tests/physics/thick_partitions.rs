//! Partitions with thickness between rooms, drawn as solids and as gaps between shells, against the slow simulator: what enters one face
//! leaves the other, whatever is beside the thickness. The long form is in `accept`.

use sonel_renderer::Estimator;
use sonel_tests::row_of_rooms::{Drawn, check, fluences, rendered, row};

/// 1 dB.
const LOSS: f64 = 0.8;

#[test]
#[ignore = "long: cargo xtask accept"]
fn next_door_gets_what_passes_whatever_the_thickness() {
    let row = row(2, 1.0);
    let counted = fluences(row, 6_000);
    for (drawn, emissions) in [(Drawn::Solids(1.0), 12_000), (Drawn::Shells(0.3), 12_000)] {
        check(&format!("{drawn:?}"), LOSS, &rendered(row, drawn, Estimator::Auto, emissions), &counted);
    }
}
