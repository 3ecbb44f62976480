//! Sound through partitions: exact through sheets in the open, the power balance of two rooms, estimators among themselves.

use glam::dvec3;
use sonel_acoustics::{Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::{Estimator, RenderSettings, Rendering};
use sonel_scene::Scene;
use sonel_testkit::analytic::free_field;
use sonel_tests::coupled_door::{DOOR, DOOR_MIDDLE, live_absorption_area};
use sonel_tests::estimates::{agree_in_windows, windows};
use sonel_tests::meshes::{add_box, add_quad};
use sonel_tests::two_rooms::{Partition, level_difference, two_rooms};
use sonel_tests::{Traced, batch_fluence, fluence, shipped};

const TRANSMISSION: [f64; 4] = [0.3, 1e-2, 1e-6, 0.0];
const BANDS: usize = TRANSMISSION.len();

/// Source and receiver 7 m apart in the open, partitions between them, which reflect nothing.
fn open(mesh: Mesh) -> Scene {
    let bands =
        Bands::new(vec![125.0, 250.0, 500.0, 1000.0], sonel_acoustics::BandWidth::Octave).expect("octaves");
    let mut wall = Material::uniform("wall", 1.0, 0.0, BANDS);
    wall.transmission = TRANSMISSION.to_vec();
    Scene::from_parts(mesh, vec![wall], bands, 0.2)
        .with_source("source", [-3.5, 0.1, 0.2])
        .with_receiver("receiver", [3.5, 0.1, 0.2])
        .without_air_attenuation()
}

fn sheet(mesh: &mut Mesh, x: f64) {
    let corner = |y: f64, z: f64| dvec3(x, y, z);
    add_quad(mesh, 0, [corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)]);
}

/// What arrives per band beside the free field, where `thickness` [m] of the way is in a partition.
fn passed(mesh: Mesh, thickness: f64) -> Vec<f64> {
    let traced = Traced::new(open(mesh), Settings { emissions: 2000, ..Settings::default() });
    assert!(traced.ledger.worst_residual() < 1e-9);
    let rendering = traced.render(RenderSettings::default());
    (0..BANDS).map(|band| fluence(&rendering, 200, 0, band) / free_field(7.0 - thickness, 0.0)).collect()
}

fn check(mesh: Mesh, thickness: f64, partitions: i32) {
    for (found, transmission) in passed(mesh, thickness).into_iter().zip(TRANSMISSION) {
        let expected = transmission.powi(partitions);
        assert!((found - expected).abs() <= 1e-6 * expected, "{found} instead of {expected}");
    }
}

#[test]
fn a_sheet_lets_its_transmission_through_and_nothing_else() {
    let mut mesh = Mesh::default();
    sheet(&mut mesh, 0.0);
    check(mesh, 0.0, 1);
}

#[test]
fn three_walls_in_a_row_multiply() {
    let mut mesh = Mesh::default();
    for x in [-1.0, 0.3, 0.35] {
        sheet(&mut mesh, x);
    }
    check(mesh, 0.0, 3);
}

/// A closed shell alone would be a room.
fn with_something_beside() -> Mesh {
    let mut mesh = Mesh::default();
    sheet(&mut mesh, -6.0);
    mesh
}

/// Its two faces are one partition, in which sound does not spread.
#[test]
fn a_slab_weakens_once() {
    let mut mesh = with_something_beside();
    add_box(&mut mesh, 0, dvec3(-0.1, -9.0, -9.0), dvec3(0.1, 9.0, 9.0));
    check(mesh, 0.2, 1);
}

/// It is no slab: who passes its walls is in its air between them.
#[test]
fn a_hut_weakens_twice() {
    let mut mesh = with_something_beside();
    add_box(&mut mesh, 0, dvec3(-2.0, -9.0, -9.0), dvec3(2.0, 9.0, 9.0));
    check(mesh, 0.0, 2);
}

/// What comes over a screen, and through a partition behind it where there is one, per receiver and band, in a room that reflects nothing.
/// Receivers are in the shadow, on both sides of its boundary 0.1 mm from it, and in sight.
fn over_screen(has_partition: bool) -> Vec<Vec<f64>> {
    let mut mesh = Mesh::default();
    add_box(&mut mesh, 1, dvec3(-9.0, -9.0, -9.0), dvec3(9.0, 9.0, 9.0));
    let corner = |y: f64, z: f64| dvec3(-1.0, y, z);
    add_quad(&mut mesh, 1, [corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 0.2), corner(-9.0, 0.2)]);
    if has_partition {
        sheet(&mut mesh, 2.0);
    }
    let mut scene = open(mesh);
    scene.materials.push(Material::uniform("black", 1.0, 0.0, BANDS));
    scene.receivers.clear();
    let heights = [-1.5, -0.3, 0.1999, 0.2001, 0.6, 1.4];
    let scene = heights.iter().fold(scene, |scene, &z| scene.with_receiver("receiver", [3.5, 0.1, z]));
    let traced = Traced::diffracting(scene, Settings { emissions: 64, ..Settings::default() });
    let rendering = traced.render(RenderSettings::default());
    let energy = |receiver: usize, band: usize| rendering.energy(receiver, band);
    (0..heights.len()).map(|receiver| (0..BANDS).map(|band| energy(receiver, band)).collect()).collect()
}

#[test]
fn sound_over_an_edge_keeps_the_transmission_of_what_it_passes() {
    let (behind, open) = (over_screen(true), over_screen(false));
    for (behind, open) in behind.iter().zip(&open) {
        for ((behind, open), transmission) in behind.iter().zip(open).zip(TRANSMISSION) {
            let expected = transmission * open;
            assert!((behind - expected).abs() <= 1e-6 * expected, "{behind:e} instead of {expected:e}");
        }
    }
    let step = behind[2][0] / behind[3][0];
    assert!((step - 1.0).abs() < 5e-3, "the direct sound that passes joins: {step}");
}

fn level(rendering: &Rendering, receiver: usize, band: usize) -> (f64, f64) {
    let (mean, error) = batch_fluence(rendering, receiver, band);
    (10.0 * mean.log10(), 10.0 * (1.0 + error / mean).log10())
}

/// Levels in both rooms for diffuse walls, by sheet and slab, against the power balance.
fn check_balance(partition: Partition) {
    let transmission = [1e-2, 1e-3, 1e-5];
    let scene = two_rooms(partition, [0.1; 2], 1.0, &transmission).with_duration(1.3);
    let traced = Traced::new(scene, Settings { emissions: 40_000, ..Settings::default() });
    assert!(traced.ledger.worst_residual() < 1e-9);
    let rendering = traced.render(RenderSettings::default());
    for (band, transmission) in transmission.into_iter().enumerate() {
        // The direct sound is no part of the diffuse field of the first room.
        let loud = 10.0
            * (fluence(&rendering, 1300, 0, band) - free_field(2.8_f64.hypot(3.2).hypot(0.2), 0.0)).log10();
        let quiet = [1, 2].map(|receiver| level(&rendering, receiver, band));
        assert!(quiet.iter().all(|(_, error)| *error < 0.1), "too noisy to mean anything: {quiet:?} dB");
        let found = loud - 0.5 * (quiet[0].0 + quiet[1].0);
        let expected = level_difference(0.1, transmission);
        assert!((found - expected).abs() < 0.3, "band {band}: {found} instead of {expected} dB");
    }
}

#[test]
fn two_rooms_have_the_level_difference_of_their_power_balance() {
    check_balance(Partition::Sheet);
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn so_have_rooms_with_a_thick_wall_between_them() {
    check_balance(Partition::Slab(0.25));
}

/// What passes an open door is a quarter of the fluence of the diffuse field before it, and the direct sound.
#[test]
fn a_room_behind_a_door_has_the_level_of_its_power_balance() {
    let scene = shipped("coupled-door").with_duration(0.8).without_air_attenuation();
    let traced = Traced::new(scene.clone(), Settings { emissions: 12_000, ..Settings::default() });
    assert!(traced.geometry.is_watertight() && traced.ledger.worst_residual() < 1e-9);
    let rendering = traced.render(RenderSettings::default());
    let source = scene.sources[0].position;
    // The field of the dry room falls with the distance from the source.
    let diffuse = [0, 1].map(|receiver| {
        let distance = scene.receivers[receiver].position.distance(source);
        0.5 * (fluence(&rendering, 800, receiver, 0) - free_field(distance, 0.0))
    });
    let diffuse = diffuse[0] + diffuse[1];
    let quiet = [2, 3].map(|receiver| level(&rendering, receiver, 0));
    let error = 0.5 * quiet[0].1.hypot(quiet[1].1);
    assert!(error < 0.1, "too noisy to mean anything: {quiet:?} dB");
    let way = DOOR_MIDDLE - source;
    let direct = free_field(way.length(), 0.0) * way.normalize().x;
    let expected = (diffuse + 4.0 * direct) * DOOR / (live_absorption_area(&scene) + DOOR);
    let found = 0.5 * (quiet[0].0 + quiet[1].0);
    let expected = 10.0 * expected.log10();
    println!("{found} against {expected} dB, {} dB below the diffuse field", 10.0 * diffuse.log10() - found);
    assert!((found - expected).abs() < 0.3, "{found} instead of {expected} dB");
}

/// One map, counted in three ways, in both rooms and over time.
#[test]
#[ignore = "long: cargo xtask accept"]
fn estimators_agree_in_both_rooms() {
    let scene = two_rooms(Partition::Sheet, [0.15; 2], 0.3, &[3e-2, 1e-4]).with_duration(0.5);
    let traced = Traced::new(scene, Settings { emissions: 60_000, ..Settings::default() });
    let borders = [0.0, 0.05, 0.2, 0.5];
    let by = |estimator| {
        windows(
            &traced,
            RenderSettings { estimator, rays: Some(16_384), ..RenderSettings::default() },
            &borders,
        )
    };
    let reference = by(Estimator::Auto);
    for estimator in [Estimator::Connection, Estimator::Gather, Estimator::Sphere] {
        let other = by(estimator);
        for (receiver, (reference, other)) in reference.iter().zip(&other).enumerate() {
            for (band, (reference, other)) in reference.iter().zip(other).enumerate() {
                agree_in_windows(other, reference, 0.15)
                    .unwrap_or_else(|flaw| panic!("{estimator:?}, receiver {receiver}, band {band}: {flaw}"));
            }
        }
    }
}
