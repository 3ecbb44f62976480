//! The long campaign of random buildings: 10⁵ pairs of source and receiver, with every estimator.

use sonel_renderer::Estimator;
use sonel_tests::general_position::{judged, leaks_over_edges};

const BUILDINGS: u64 = 25_000;
/// Buildings after which the campaign says how far it is.
const BLOCK: u64 = 500;
/// Order up to which every path is looked for.
const ORDER: u32 = 3;
/// Pairs whose paths are right but have the energy of a box that stands flush behind their wall: which of the two materials faces the room, such
/// a drawing leaves open (docs/decisions.md).
const FLUSH_PAIRS: usize = 4;

#[test]
fn nothing_passes_a_sealed_wall_and_no_image_is_lost_or_invented() {
    let (mut pairs, mut faults) = (0, Vec::new());
    for first in (1000..1000 + BUILDINGS).step_by(BLOCK as usize) {
        let of_block = judged(first..first + BLOCK, &Estimator::COMPARABLE, ORDER);
        (pairs, faults) = (pairs + of_block.0, [faults, of_block.1].concat());
        println!("buildings up to seed {}: {pairs} pairs, {} faults", first + BLOCK, faults.len());
    }
    let (of_energy, others): (Vec<String>, Vec<String>) =
        faults.into_iter().partition(|fault| fault.contains("images bring"));
    assert!(others.is_empty(), "{} faults in {pairs} pairs:\n{}", others.len(), others.join("\n"));
    assert!(of_energy.len() <= FLUSH_PAIRS, "of {pairs} pairs:\n{}", of_energy.join("\n"));
}

/// Ten thousand pairs behind sealed walls with free ends.
#[test]
fn no_edge_carries_sound_past_a_sealed_wall() {
    let (pairs, leaks) = leaks_over_edges(1000..7600);
    println!("{pairs} sealed pairs, {} leaks", leaks.len());
    assert!(pairs > 10_000, "{pairs}");
    assert!(leaks.is_empty(), "{}", leaks.join("\n"));
}
