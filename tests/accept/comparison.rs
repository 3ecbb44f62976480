//! Comparing maps: seeds are the same, walls are not. The quick form is in tests/pipeline.

use rayon::prelude::*;
use sonel_analysis::map_comparison::{MapComparison, compare};
use sonel_map::Settings;
use sonel_scene::Scene;
use sonel_tests::{Traced, shipped, wrong_levels};

const PAIRS: u64 = 100;
/// Of a hundred pairs one is expected to differ at most; four or more do with a probability below 2 %.
const FEWEST_SAME: usize = 97;

/// Pairs of seeds of `scene`, the second map with a fifth of the emissions when `uneven`.
fn pairs(scene: &Scene, settings: Settings, uneven: bool) -> Vec<MapComparison> {
    (0..PAIRS)
        .into_par_iter()
        .map(|pair| {
            let traced = |seed: u64| {
                let emissions = settings.emissions / if uneven && seed == 2 { 5 } else { 1 };
                Traced::new(scene.clone(), Settings { seed: 2 * pair + seed, emissions, ..settings })
            };
            let [a, b] = [traced(1), traced(2)];
            compare(a.as_traced(), b.as_traced()).expect("maps of one scene")
        })
        .collect()
}

fn check(scene: &Scene, settings: Settings, uneven: bool) {
    let found = pairs(scene, settings, uneven);
    let same = found.iter().filter(|pair| pair.beyond_noise().is_empty()).count();
    let wrong = found.iter().filter(|pair| !wrong_levels::one_by_one(pair)).count();
    let tested: usize = found[0].tiers.iter().map(|tier| tier.cells.len()).sum();
    println!(
        "{}, {} emissions, uneven {uneven}: {tested} cells, same in {same} of {PAIRS}; one by one in {wrong}",
        scene.name, settings.emissions
    );
    assert!(same >= FEWEST_SAME);
    assert!(wrong < FEWEST_SAME, "testing every cell at 1 % goes unnoticed");
}

#[test]
fn seeds_of_the_seed_room_are_the_same() {
    check(&shipped("seed-room"), Settings { emissions: 20_000, ..Settings::default() }, false);
}

/// Fewer batches: the tails of Student's t are long, and normal quantiles would not do.
#[test]
fn seeds_in_four_batches_are_the_same() {
    let settings = Settings { emissions: 10_000, batches: 4, ..Settings::default() };
    let scene = shipped("shoebox");
    check(&scene, settings, false);
    let found = pairs(&scene, settings, false);
    let normal = found.iter().filter(|pair| !wrong_levels::by_the_normal_distribution(pair)).count();
    println!("by the normal distribution: same in {normal} of {PAIRS}");
    assert!(normal < FEWEST_SAME);
}

#[test]
fn seeds_of_maps_of_unequal_size_are_the_same() {
    check(&shipped("shoebox"), Settings { emissions: 20_000, ..Settings::default() }, true);
    check(&shipped("seed-room"), Settings { emissions: 20_000, ..Settings::default() }, true);
}

/// Many small surfaces, eight materials, eight bands, most cells sparse.
#[test]
fn seeds_of_the_hall_are_the_same() {
    check(&shipped("hall"), Settings { emissions: 5_000, ..Settings::default() }, false);
}

/// 0.15 → 0.20 of any one wall of the seed room, the screen included, with another seed.
#[test]
fn every_wall_that_absorbs_more_is_found() {
    let changed = |absorption: f64, wall: usize, seed: u64| {
        let mut scene = shipped("seed-room");
        let mut other = scene.materials[0].clone();
        "other".clone_into(&mut other.name);
        other.absorption.fill(absorption);
        scene.materials.push(other);
        for triangle in &mut scene.mesh.triangles[2 * wall..2 * wall + 2] {
            triangle.material = 1;
        }
        Traced::new(scene, Settings { emissions: 100_000, seed, ..Settings::default() })
    };
    for wall in 0..7 {
        let (before, after) = (changed(0.15, wall, 1), changed(0.20, wall, 2));
        let comparison = compare(before.as_traced(), after.as_traced()).expect("one scene");
        let beyond = comparison.beyond_noise();
        println!("wall {wall}: {} cells differ, first {:?}", beyond.len(), beyond.first());
        assert!(!beyond.is_empty(), "wall {wall}");
    }
}
