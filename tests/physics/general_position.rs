//! Nothing in general position: random buildings on a grid, and small scenes in which paths meet edges, junctions and planes
//! of other faces exactly.

use std::path::Path;

use glam::DVec3;
use sonel_map::Settings;
use sonel_renderer::{DiscreteArrival, Estimator, RenderSettings};
use sonel_scene::Scene;
use sonel_tests::buildings::Building;
use sonel_tests::general_position::judged;
use sonel_tests::{Traced, fluence};

/// Buildings with some four pairs of source and receiver each; the long form is in `accept`.
const BUILDINGS: u64 = 250;

#[test]
fn nothing_passes_a_sealed_wall_and_no_image_is_lost_or_invented() {
    let (pairs, faults) = judged(0..BUILDINGS, &[Estimator::Auto, Estimator::Sphere]);
    assert!(pairs > 900, "{pairs}");
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

/// The sibling: one triangle of a wall is missing.
#[test]
fn sound_passes_a_wall_with_a_hole() {
    let leaks = (0..20).filter(|&seed| {
        let mut building = Building::new(seed);
        let [source, receiver] = [0, building.rooms.len() - 1].map(|room| building.place(room));
        let (Some(source), Some(receiver)) = (source, receiver) else { return false };
        if source.is_connected(&receiver) {
            return false;
        }
        let divides = |corners: [DVec3; 3]| {
            let apart = |axis: usize| {
                let at = corners.map(|corner| corner[axis]);
                let [from, to] = [source.position[axis], receiver.position[axis]];
                at.iter().all(|x| (x - at[0]).abs() < 1e-9) && (at[0] - from) * (at[0] - to) < 0.0
            };
            (0..3).any(apart)
        };
        let mesh = building.mesh.clone();
        building
            .mesh
            .triangles
            .retain(|triangle| !divides(triangle.corners.map(|c| mesh.vertices[c as usize])));
        let scene = building.scene(source.position, &[receiver], 0.1);
        let traced = Traced::new(scene, Settings { emissions: 64, ..Settings::default() });
        fluence(&traced.render(RenderSettings::default()), 100, 0, 0) > 0.0
    });
    assert!(leaks.count() >= 5);
}

/// A scene of `tests/cases`.
fn case(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
    let text = std::fs::read_to_string(folder.join(format!("{name}.toml"))).expect("a case of the tests");
    sonel_scene::load(&text, name, &mut |mesh| std::fs::read(folder.join(mesh))).expect("a valid scene").scene
}

/// Arrivals up to an order at the receivers of a case.
fn arrivals(scene: Scene, order: u32) -> Vec<DiscreteArrival> {
    let traced = Traced::new(scene, Settings { emissions: 8, ..Settings::default() });
    traced.render(RenderSettings { mirror_order: Some(order), ..RenderSettings::default() }).arrivals
}

/// A path that would turn where a wall's plane, but not the wall, crosses another surface is none.
#[test]
fn planes_beyond_their_faces_mirror_nothing() {
    let found = arrivals(case("corner"), 3);
    assert!(!found.is_empty() && found.iter().all(|it| it.order < 3), "{found:?}");
    let found = arrivals(case("canyon"), 3);
    assert!(found.iter().all(|it| (it.length - 82.486).abs() > 1e-3), "{found:?}");
}

/// What touches a wall from behind takes nothing from the path in front of it.
#[test]
fn what_stands_behind_a_wall_hides_nothing_in_front() {
    let first: Vec<f64> =
        arrivals(case("behind"), 4).iter().filter(|it| it.order == 1).map(|it| it.length).collect();
    assert_eq!(first.len(), 6, "{first:?}");
    assert!(first.iter().any(|length| (length - 20_f64.sqrt()).abs() < 1e-9), "{first:?}");
}

/// A sheet aslant that reaches all walls, and a partition drawn as two sheets that overlap.
#[test]
fn sheets_that_reach_all_walls_are_tight() {
    let mut sheet = case("sealed-sheet");
    sheet.receivers.clear();
    for (name, at) in
        [[83.0, 33.0, 22.0], [83.0, 93.0, 32.0], [83.0, 53.0, 32.0], [63.0, 23.0, 12.0]].iter().enumerate()
    {
        sheet = sheet.with_receiver(&name.to_string(), *at);
    }
    for scene in [sheet, case("overlap")] {
        let (receivers, duration) = (scene.receivers.len(), scene.duration);
        let traced = Traced::new(scene, Settings { emissions: 2000, ..Settings::default() });
        let rendering = traced.render(RenderSettings { mirror_order: Some(4), ..RenderSettings::default() });
        for receiver in 0..receivers {
            let bins = (duration / 0.001).round() as usize;
            assert!(fluence(&rendering, bins, receiver, 0) <= 0.0, "{receiver}");
        }
    }
}
