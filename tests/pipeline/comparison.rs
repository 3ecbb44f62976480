//! Two maps: same within noise where only the seed differs, different where a wall does.
//!
//! The long form, a hundred pairs, is in tests/accept.

use sonel_analysis::map_comparison::{ArrivalPlace, MapPairing, PlaceKind, compare};
use sonel_map::{Settings, Spectral};
use sonel_scene::Scene;
use sonel_tests::{Traced, shipped, wrong_levels};

/// Two materials, so that one can change; short, so that twenty pairs are quick.
fn room(absorption_of_floor: f64) -> Scene {
    let mut scene = shipped("seed-room");
    scene.duration = 4.0;
    let mut floor = scene.materials[0].clone();
    "floor".clone_into(&mut floor.name);
    floor.absorption.fill(absorption_of_floor);
    scene.materials.push(floor);
    for triangle in &mut scene.mesh.triangles[..2] {
        triangle.material = 1;
    }
    scene
}

fn traced(absorption_of_floor: f64, settings: Settings) -> Traced {
    Traced::new(room(absorption_of_floor), settings)
}

fn settings(emissions: u64, seed: u64) -> Settings {
    Settings { emissions, seed, ..Settings::default() }
}

/// 20 pairs at a level of 1 %: two or more differ with a probability of 1.7 %, and the seeds are constants.
#[test]
fn two_seeds_of_one_scene_are_the_same() {
    let differ = (0..20_u64).filter(|pair| {
        let [a, b] = [1, 2].map(|seed| traced(0.15, settings(2_000, 2 * pair + seed)));
        let comparison = compare(a.as_traced(), b.as_traced()).unwrap();
        assert_eq!(comparison.pairing, MapPairing::Independent);
        assert!(comparison.tiers.iter().all(|tier| !tier.cells.is_empty()), "every kind of place is tested");
        !comparison.beyond_noise().is_empty()
    });
    assert!(differ.count() <= 1);
}

/// The sibling: cells tested one by one at 1 %, and normal quantiles for the few degrees of freedom of two batches, both
/// tell seeds apart.
#[test]
fn wrong_statistics_tell_seeds_apart() {
    let pairs: Vec<_> = (0..10_u64)
        .map(|pair| {
            let few = |seed| traced(0.15, Settings { batches: 2, ..settings(2_000, 2 * pair + seed) });
            let [a, b] = [1, 2].map(few);
            compare(a.as_traced(), b.as_traced()).unwrap()
        })
        .collect();
    assert!(pairs.iter().all(|pair| pair.beyond_noise().is_empty()));
    let differ = |count: &dyn Fn(&sonel_analysis::map_comparison::MapComparison) -> bool| {
        pairs.iter().filter(|pair| count(pair)).count()
    };
    assert!(differ(&|pair| wrong_levels::one_by_one(pair)) > 1, "no level for the family");
    assert!(differ(&|pair| wrong_levels::by_the_normal_distribution(pair)) > 1, "normal instead of Student");
}

#[test]
fn a_wall_that_absorbs_more_is_found_with_other_and_with_the_same_seed() {
    let before = traced(0.15, settings(10_000, 1));
    for (seed, pairing) in [(2, MapPairing::Independent), (1, MapPairing::Batches)] {
        let after = traced(0.20, settings(10_000, seed));
        let comparison = compare(before.as_traced(), after.as_traced()).unwrap();
        assert_eq!(comparison.pairing, pairing);
        let beyond = comparison.beyond_noise();
        assert!(beyond.iter().any(|cell| cell.place == ArrivalPlace::Room));
        assert!(beyond.iter().all(|cell| cell.ratio_db.unwrap() < 0.0), "more absorption, less energy");
        let most = beyond[0].interval_db.unwrap();
        assert!(most[0] < beyond[0].ratio_db.unwrap() && beyond[0].ratio_db.unwrap() < most[1]);
    }
}

/// Bands, batches, shards and sizes may differ: energies are per unit emitted.
#[test]
fn other_numbers_of_emissions_and_batches_are_no_difference() {
    let large = traced(0.15, settings(12_000, 1));
    for other in [
        settings(2_000, 2),
        settings(2_000, 1),
        Settings { batches: 7, ..settings(3_001, 3) },
        Settings { survival: 0.5, ..settings(4_000, 4) },
        Settings { spectral: Spectral::PerBand, ..settings(2_000, 5) },
    ] {
        let small = traced(0.15, other);
        let comparison = compare(large.as_traced(), small.as_traced()).unwrap();
        assert!(comparison.beyond_noise().is_empty(), "{other:?}: {:?}", comparison.beyond_noise()[0]);
        assert!(!comparison.tiers[0].cells.is_empty());
    }
}

/// Late in a paper map no packet is left where an accurate one still has thousands: a lack of arrivals is no difference.
#[test]
fn windows_that_a_small_map_does_not_reach_are_sparse() {
    let (large, small) = (traced(0.15, settings(12_000, 1)), {
        let paper = Settings { survival: 1.0, spectral: Spectral::PerBand, ..settings(2_000, 2) };
        traced(0.15, paper)
    });
    let comparison = compare(large.as_traced(), small.as_traced()).unwrap();
    assert!(comparison.beyond_noise().is_empty(), "{:?}", comparison.beyond_noise()[0]);
    assert!(comparison.tiers.iter().all(|tier| tier.sparse > 0 || tier.kind == PlaceKind::Room));
}

#[test]
fn the_same_random_numbers_leave_no_difference_but_that_of_the_wall() {
    let before = traced(0.15, settings(3_000, 1));
    let again = compare(before.as_traced(), before.as_traced()).unwrap();
    assert!(again.tiers.iter().flat_map(|tier| &tier.cells).all(|cell| cell.significance() <= 0.0));
    let after = traced(0.152, settings(3_000, 1));
    let comparison = compare(before.as_traced(), after.as_traced()).unwrap();
    assert!(!comparison.beyond_noise().is_empty(), "0.002 of one wall shows in paired batches");
    let other = traced(0.152, settings(3_000, 2));
    let comparison = compare(before.as_traced(), other.as_traced()).unwrap();
    assert!(comparison.beyond_noise().is_empty(), "and not in independent ones");
}

#[test]
fn places_without_counterpart_are_said_and_not_judged() {
    let before = traced(0.15, settings(3_000, 1));
    let mut lower = room(0.15);
    for vertex in lower.mesh.vertices.iter_mut().filter(|vertex| vertex.y > 25.0) {
        vertex.y -= 5.0;
    }
    let after = Traced::new(lower, settings(3_000, 2));
    let comparison = compare(before.as_traced(), after.as_traced()).unwrap();
    // Ceiling and walls move, floor and screen stay.
    assert!(comparison.without_counterpart[0].starts_with("5 of the 7 surfaces of A"), "{comparison:?}");
    assert!(!comparison.beyond_noise().is_empty());
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let [a, b] = [1, 2].map(|seed| traced(0.15, Settings { batches: 40, ..settings(3_000, seed) }));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| compare(a.as_traced(), b.as_traced()).unwrap())
    };
    assert!(with(1) == with(3));
}
