//! Rooms between walls that are solids are those of thin shells.

use sonel_tests::solid_buildings::{SolidBuilding, Style};

/// Buildings in four styles each; the larger numbers in release, where `cargo xtask accept` runs it.
const BUILDINGS: u64 = if cfg!(debug_assertions) { 3 } else { 300 };
const WITH_IMAGES: u64 = if cfg!(debug_assertions) { 2 } else { 100 };
/// Reflections of image sources.
const ORDER: u32 = if cfg!(debug_assertions) { 2 } else { 3 };

/// Buildings of which one prism ends a little beside another one: strips of 0.05 and 2 mm.
const NARROW: [(u64, Style); 2] = [(100, Style::Overlapping), (203, Style::Overlapping)];
/// One that sees the edges of an opening almost along them.
const ALONG_EDGES: (u64, Style) = (92, Style::Butted);

fn all(seeds: std::ops::Range<u64>) -> impl Iterator<Item = (u64, Style)> {
    seeds.flat_map(|seed| Style::ALL.map(|style| (seed, style)))
}

fn assert_none(faults: &[String]) {
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults[..faults.len().min(40)].join("\n"));
}

#[test]
fn rooms_between_solids_have_volume_area_and_walls_of_thin_shells() {
    let of = |(seed, style)| {
        let mut building = SolidBuilding::new(seed);
        let mesh = building.solids(style, None);
        building.faults(mesh).into_iter().map(move |fault| format!("{seed} {style:?}: {fault}"))
    };
    assert_none(&all(0..BUILDINGS).chain(NARROW).flat_map(of).collect::<Vec<String>>());
}

fn assert_same_images(effects: &[&str]) {
    let of = |(seed, style)| {
        let mut building = SolidBuilding::new(seed);
        let mesh = building.solids(style, None);
        let faults = building.image_faults(mesh, ORDER, effects).into_iter();
        faults.map(move |fault| format!("{seed} {style:?}: {fault}"))
    };
    assert_none(&all(0..WITH_IMAGES).chain([ALONG_EDGES]).flat_map(of).collect::<Vec<String>>());
}

#[test]
fn image_sources_between_solids_are_those_of_thin_shells() {
    assert_same_images(&[]);
}

#[test]
fn by_default_effects_they_are_too() {
    assert_same_images(&["diffraction", "boundary"]);
}

/// The sibling: a wall between two rooms is missing.
#[test]
fn a_building_without_one_of_its_walls_is_another() {
    let mut found = 0;
    for seed in 0..BUILDINGS.min(20) {
        let mut building = SolidBuilding::new(seed);
        let Some(wall) = building.inner_wall() else { continue };
        let mesh = building.solids(Style::Butted, Some(wall));
        assert!(!building.faults(mesh).is_empty(), "{seed}");
        found += 1;
    }
    assert!(found > 0);
}

/// The sibling: slabs are of the material of columns.
#[test]
fn image_sources_of_another_material_are_others() {
    let mut building = SolidBuilding::new(0);
    let mut mesh = building.solids(Style::Butted, None);
    let slabs = mesh.triangles.iter_mut().filter(|triangle| triangle.material == 0);
    slabs.for_each(|triangle| triangle.material = 2);
    assert!(!building.image_faults(mesh, 1, &[]).is_empty());
}
