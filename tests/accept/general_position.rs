//! The long campaign of random buildings: 10⁵ pairs of source and receiver, with every estimator.

use sonel_renderer::Estimator;
use sonel_tests::general_position::judged;

const BUILDINGS: u64 = 25_000;
/// Order up to which every path is looked for.
const ORDER: u32 = 3;

#[test]
fn nothing_passes_a_sealed_wall_and_no_image_is_lost_or_invented() {
    let (pairs, faults) = judged(1000..1000 + BUILDINGS, &Estimator::COMPARABLE, ORDER);
    println!("{pairs} pairs, {} faults", faults.len());
    assert!(faults.is_empty(), "{} faults in {pairs} pairs:\n{}", faults.len(), faults.join("\n"));
}
