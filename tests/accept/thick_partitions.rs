//! Three rooms in a row with partitions of several thicknesses and drawings, by every estimator, against the slow simulator.

use sonel_renderer::Estimator;
use sonel_tests::row_of_rooms::{Drawn, check, fluences, rendered, row};

const EMISSIONS: u64 = 100_000;
/// 0.3 dB.
const LOSS: f64 = 0.933;

#[test]
fn three_rooms_in_a_row_get_what_passes_whatever_the_thickness() {
    let row = row(3, 0.4);
    let counted = fluences(row, 60_000);
    for drawn in [
        Drawn::Sheets,
        Drawn::Solids(0.1),
        Drawn::Solids(0.3),
        Drawn::Solids(1.0),
        Drawn::Shells(0.3),
        Drawn::Faces(0.1),
        Drawn::Faces(0.9),
    ] {
        let rendered = rendered(row, drawn, Estimator::Auto, EMISSIONS);
        println!("{drawn:?}: {:.3?} dB", check(&format!("{drawn:?}"), LOSS, &rendered, &counted));
    }
    let gathered = rendered(row, Drawn::Solids(0.3), Estimator::Gather, EMISSIONS);
    println!("gather: {:.3?} dB", check("gather", LOSS, &gathered, &counted));
}

/// Few packets cross a sphere behind two partitions: one, of 1 m, where 1 dB was lost.
#[test]
fn spheres_next_door_get_what_passes_a_metre() {
    let row = row(2, 0.4);
    let found = rendered(row, Drawn::Solids(1.0), Estimator::Sphere, EMISSIONS);
    println!("sphere: {:.3?} dB", check("sphere", 0.8, &found, &fluences(row, 20_000)));
}
