//! Nothing in general position: random buildings on a grid, and small scenes in which paths meet edges, junctions and planes
//! of other faces exactly.

use std::path::Path;

use glam::DVec3;
use sonel_geometry::{Geometry, Mesh, MeshTriangle};
use sonel_map::Settings;
use sonel_renderer::{DiscreteArrival, Estimator, RenderSettings};
use sonel_scene::Scene;
use sonel_testkit::analytic::specular_box::SpecularBox;
use sonel_tests::buildings::Building;
use sonel_tests::general_position::{DURATION, judged, leaks_over_edges, wrong_path};
use sonel_tests::specular_paths::{Mirrors, SpecularPath};
use sonel_tests::{Traced, fluence};

/// Buildings with some four pairs of source and receiver each; the long form is in `accept`.
const BUILDINGS: u64 = 30;
/// Buildings with edges, and those whose volume is asked for.
const WITH_EDGES: u64 = if cfg!(debug_assertions) { 16 } else { 30 };
const WITH_VOLUME: u64 = if cfg!(debug_assertions) { 30 } else { 60 };

#[test]
fn nothing_passes_a_sealed_wall_and_no_image_is_lost_or_invented() {
    let (pairs, mut faults) = judged(0..BUILDINGS, &[Estimator::Auto], 2);
    assert!(pairs > 100, "{pairs}");
    faults.extend(judged(0..BUILDINGS / 10, &[Estimator::Sphere], 0).1);
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

/// Walls that go on beyond a corner, niches and sheets through walls have edges in both rooms, and none that joins them.
#[test]
fn no_edge_carries_sound_past_a_sealed_wall() {
    let (pairs, leaks) = leaks_over_edges(0..WITH_EDGES);
    assert!(pairs as u64 > WITH_EDGES, "{pairs}");
    assert!(leaks.is_empty(), "{} leaks:\n{}", leaks.len(), leaks.join("\n"));
}

/// Volumes are those of the rooms less their solids.
#[test]
fn air_is_told_from_solids_however_walls_are_drawn() {
    let is_wrong = |seed: &u64| {
        let building = Building::new(*seed);
        let geometry = Geometry::build(building.mesh.clone()).unwrap();
        geometry.volume().is_none_or(|volume| (volume / building.volume() - 1.0).abs() > 1e-6)
    };
    let wrong: Vec<u64> = (0..WITH_VOLUME).filter(is_wrong).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// The sibling: one triangle of a wall is missing.
#[test]
fn sound_passes_a_wall_with_a_hole() {
    // One building in four is turned.
    let leaks = (0..14).filter(|seed| seed % 4 != 3).filter(|&seed| {
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
    assert!(leaks.count() >= 3);
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

/// Displacements of a source and a receiver.
const DISPLACEMENTS: [DVec3; 2] = [DVec3::new(0.2, -0.1, 0.4), DVec3::new(-0.2, 0.3, 0.35)];

/// The judge itself: in a box it finds the image sources of the formula, and a screen takes what passes it.
#[test]
fn every_path_of_a_box_is_found_among_its_triangles() {
    let (from, to) = (DVec3::ONE, DVec3::new(3.0, 1.0, 1.0));
    let mut mesh = Mesh::shoebox([4.0, 3.0, 2.0], [0; 6]);
    let paths = |mesh: &Mesh, order| Mirrors::of(mesh).paths([from, to], DISPLACEMENTS, order, 1e3);
    let exact = SpecularBox {
        size: [4.0, 3.0, 2.0],
        reflection: [1.0; 6],
        speed_of_sound: 1.0,
        air_attenuation: 0.0,
    };
    let mut found: Vec<f64> = paths(&mesh, 3).iter().map(|path| path.image.distance(to)).collect();
    let mut right: Vec<f64> =
        exact.arrivals_to_order(from.to_array(), to.to_array(), 3).iter().map(|it| it.time).collect();
    found.sort_by(f64::total_cmp);
    right.sort_by(f64::total_cmp);
    assert_eq!(found.len(), right.len());
    assert!(found.iter().zip(&right).all(|(found, right)| (found - right).abs() < 1e-9));
    let first = mesh.vertices.len() as u32;
    mesh.vertices
        .extend([[0.0, 0.0], [3.0, 0.0], [3.0, 1.5], [0.0, 1.5]].map(|[y, z]| DVec3::new(2.0, y, z)));
    let screen = [[0, 1, 2], [0, 2, 3]].map(|corners: [u32; 3]| corners.map(|corner| first + corner));
    mesh.triangles.extend(screen.map(|corners| MeshTriangle { corners, material: 0 }));
    let over_the_ceiling = SpecularPath { order: 1, image: DVec3::new(1.0, 1.0, 3.0) };
    assert_eq!(paths(&mesh, 1), [over_the_ceiling]);
}

/// A walk in steps of a centimetre through the ties of the small scenes: at every place the paths that are listed are those that there are.
#[test]
fn paths_come_and_go_where_walls_begin_and_end() {
    for name in ["corner", "canyon", "false43", "behind"] {
        for axis in DVec3::AXES {
            let (scene, arrivals) = walk(name, axis);
            assert_eq!(wrong(&scene, &arrivals), None, "{name}");
        }
    }
}

/// The sibling: a path more or less, or a wall less, is seen.
#[test]
fn a_path_too_many_or_too_few_is_seen() {
    let (mut scene, mut arrivals) = walk("behind", DVec3::X);
    let last = arrivals.iter().rposition(|it| it.order <= 2).unwrap();
    let path = arrivals.remove(last);
    assert!(wrong(&scene, &arrivals).unwrap().ends_with("is missing"));
    arrivals.extend([path.clone(), path]);
    assert!(wrong(&scene, &arrivals).unwrap().ends_with("is none"));
    arrivals.pop();
    scene.mesh.triangles.remove(0);
    assert!(wrong(&scene, &arrivals).is_some());
}

/// A case with receivers within 20 cm of its own along an axis, and the arrivals at them.
fn walk(name: &str, axis: DVec3) -> (Scene, Vec<DiscreteArrival>) {
    let mut scene = case(name);
    let middle = scene.receivers[0].position;
    scene.receivers.clear();
    scene.duration = DURATION;
    for step in -20..=20 {
        let place = middle + axis * (0.01 * f64::from(step));
        scene = scene.with_receiver(&step.to_string(), place.to_array());
    }
    let arrivals = arrivals(scene.clone(), 3);
    (scene, arrivals)
}

/// What is wrong with the arrivals of up to two reflections at any receiver of a scene.
fn wrong(scene: &Scene, arrivals: &[DiscreteArrival]) -> Option<String> {
    let mirrors = Mirrors::of(&scene.mesh);
    let geometry = scene.geometry().expect("a case has walls");
    scene.receivers.iter().enumerate().find_map(|(index, receiver)| {
        let ends = [scene.sources[0].position, receiver.position];
        let wrong =
            wrong_path(&mirrors, &geometry, ends, 2, arrivals.iter().filter(|it| it.receiver == index));
        wrong.map(|wrong| format!("{}: {wrong}", receiver.name))
    })
}
