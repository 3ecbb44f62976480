//! Edges: shorter than the wavelength, nearly flat, nearly folded, nearly in contact, hundreds of them; sources and
//! receivers on their lines, in the planes of their faces, on the edges themselves.

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::analytic::free_field;
use sonel_tests::{Traced, fluence, meshes};

use super::form;

const BANDS: [f64; 8] = [63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];
const DURATION: f64 = 0.2;
const SOURCE: DVec3 = dvec3(-4.0, 0.3, 1.1);
/// Largest step of a level where a receiver moves by a micrometre [dB]: what docs/diffraction.md promises for a millimetre.
const LARGEST_STEP_DB: f64 = 0.1;

/// A scene of mirrors in the open: nothing in it is noise.
fn scene(mesh: Mesh, source: DVec3, receivers: &[DVec3]) -> Scene {
    let bands = Bands::new(BANDS.to_vec(), BandWidth::Octave).expect("octaves");
    let mut scene =
        Scene::from_parts(mesh, vec![Material::uniform("rigid", 0.0, 0.0, BANDS.len())], bands, DURATION)
            .with_source("source", source.to_array())
            .without_air_attenuation();
    scene.speed_of_sound = 343.0;
    receivers
        .iter()
        .enumerate()
        .fold(scene, |scene, (index, at)| scene.with_receiver(&format!("{index}"), at.to_array()))
}

/// Energies at every receiver in all bands [1/m²].
fn energies(scene: Scene, diffracting: bool) -> Vec<Vec<f64>> {
    let receivers = scene.receivers.len();
    let trace = if diffracting { Traced::diffracting } else { Traced::new };
    let traced = trace(scene, Settings { emissions: 32, ..Settings::default() });
    let settings = RenderSettings { bin: 0.01, mirror_order: Some(2), ..RenderSettings::default() };
    let bins = (DURATION / settings.bin).round() as usize;
    let rendering = traced.render(settings);
    let at = |receiver| (0..BANDS.len()).map(|band| fluence(&rendering, bins, receiver, band)).collect();
    (0..receivers).map(at).collect()
}

/// A rectangle in the plane x = `x` [m].
fn sheet(mesh: &mut Mesh, x: f64, y: [f64; 2], z: [f64; 2]) {
    meshes::add_quad(
        mesh,
        0,
        [dvec3(x, y[0], z[0]), dvec3(x, y[1], z[0]), dvec3(x, y[1], z[1]), dvec3(x, y[0], z[1])],
    );
}

fn one_sheet(y: [f64; 2], z: [f64; 2]) -> Mesh {
    let mut mesh = Mesh::default();
    sheet(&mut mesh, 0.0, y, z);
    mesh
}

/// Two planes that meet in a ridge along y and leave `angle` [rad] of air about it.
fn ridge(angle: f64) -> Mesh {
    let half = 0.5 * (std::f64::consts::TAU - angle);
    let (far, down) = (3.0 * half.sin(), -3.0 * half.cos());
    let mut mesh = Mesh::default();
    for side in [-1.0, 1.0] {
        let foot = |y: f64| dvec3(side * far, y, 1.0 + down);
        let ridge = |y: f64| dvec3(0.0, y, 1.0);
        meshes::add_quad(&mut mesh, 0, [foot(-4.0), foot(4.0), ridge(4.0), ridge(-4.0)]);
    }
    mesh
}

/// A closed slab on end, `thickness` [m] thick, and far away a tile that makes the scene an open one.
fn slab(thickness: f64) -> Mesh {
    let mut mesh = Mesh::default();
    sheet(&mut mesh, 30.0, [29.0, 30.0], [-30.0, -29.0]);
    meshes::add_box(&mut mesh, 0, dvec3(0.0, -3.0, -1.0), dvec3(thickness, 3.0, 1.5));
    mesh
}

/// A lattice of panels with gaps, `count` along y and z.
fn lattice(count: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for place in 0..count * count {
        let [y, z] = [place % count, place / count].map(|at| 0.3 * (f64::from(at) - 0.5 * f64::from(count)));
        sheet(&mut mesh, 0.0, [y, y + 0.2], [z, z + 0.2]);
    }
    mesh
}

/// Obstacles that are hard in one way each.
fn obstacles() -> Vec<(&'static str, Mesh)> {
    vec![
        ("a panel of 5 cm", one_sheet([0.28, 0.33], [1.08, 1.13])),
        ("a strip of 2 cm", one_sheet([-1.0, 1.0], [1.09, 1.11])),
        ("a ridge of π + 1e-5", ridge(std::f64::consts::PI + 1e-5)),
        ("a ridge of π + 1e-3", ridge(std::f64::consts::PI + 1e-3)),
        ("a ridge of 2π - 1e-3", ridge(std::f64::consts::TAU - 1e-3)),
        ("a slab of 1 mm", slab(1e-3)),
        ("a slab of 20 µm", slab(2e-5)),
        ("a slab of 2 m", slab(2.0)),
        ("hundreds of panels", lattice(form(3, 12))),
    ]
}

/// Places about an obstacle whose upper edge runs along y at x = 0, z = 1.5 m, or where `SOURCE` sees one like it.
fn places() -> Vec<DVec3> {
    let mut places = vec![
        dvec3(5.0, 0.3, 1.1),
        dvec3(5.0, 0.3, 1.9),
        dvec3(0.0, 0.3, 2.5),
        dvec3(0.0, 5.0, 1.1),
        dvec3(0.0, 5.0, 1.5),
        dvec3(1e-6, 0.3, 1.51),
        dvec3(2.0, 0.3, 1.5),
        SOURCE.with_x(4.0),
        dvec3(1.0, 0.3, 1.5 + 1e-6),
        dvec3(0.5, -0.2, 1.12),
    ];
    // Along the way over an edge from the source to its shadow boundary and beyond.
    places.extend([0.5, 1.0, 3.0].map(|beyond| {
        let edge = dvec3(0.0, 0.3, 1.5);
        edge + beyond * (edge - SOURCE).normalize()
    }));
    places
}

/// Every parameter is finite; and bounded: a wave that is seen and its image bring at most twice the pressure of the free
/// field at the place, each of the edges at most as much again, but where the edge is nearer than the source.
#[test]
fn every_obstacle_is_heard_at_every_place() {
    for (name, mesh) in obstacles() {
        // On an edge and inside a slab nothing can stand.
        let geometry = sonel_geometry::Geometry::build(mesh.clone()).expect("an obstacle");
        let is_free = |place: &DVec3| geometry.obstacle(*place, &[SOURCE]).is_none();
        let places: Vec<DVec3> = places().into_iter().step_by(form(2, 1)).filter(is_free).collect();
        assert!(places.len() > form(3, 8), "{name}");
        for (place, energies) in places.iter().zip(energies(scene(mesh.clone(), SOURCE, &places), true)) {
            let free = free_field(place.distance(SOURCE), 0.0);
            for (band, energy) in BANDS.iter().zip(energies) {
                assert!(energy.is_finite() && energy >= 0.0, "{name}, {place}, {band} Hz: {energy}");
                assert!(
                    energy < 36.0 * free,
                    "{name}, {place}, {band} Hz: {:.1} of the free field",
                    energy / free
                );
            }
        }
    }
}

/// `place`, and a micrometre from it in six directions.
fn neighbours(place: DVec3) -> Vec<DVec3> {
    let steps = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    [DVec3::ZERO].into_iter().chain(steps).map(|step| place + 1e-6 * step).collect()
}

/// Level at `place` and a micrometre from it in six directions: the largest step in any band [dB].
fn largest_step_db(mesh: &Mesh, place: DVec3, diffracting: bool) -> f64 {
    let energies = energies(scene(mesh.clone(), SOURCE, &neighbours(place)), diffracting);
    let level = |energy: f64| 10.0 * energy.max(1e-30).log10();
    let step = |there: &Vec<f64>| {
        let pairs = energies[0].iter().zip(there);
        pairs.map(|(&here, &there)| (level(here) - level(there)).abs()).fold(0.0, f64::max)
    };
    energies[1..].iter().map(step).fold(0.0, f64::max)
}

/// On shadow boundaries, in the planes of faces and on edges rounding decides who sees what, and must decide nothing that
/// is heard.
#[test]
fn a_micrometre_is_not_heard() {
    let mut worst = 0.0_f64;
    for (name, mesh) in obstacles().into_iter().step_by(form(3, 1)) {
        if name.contains("panels") {
            continue;
        }
        let geometry = sonel_geometry::Geometry::build(mesh.clone()).expect("an obstacle");
        // Receivers keep off surfaces; on an edge the limit is not the same from all sides.
        let is_free = |place: &DVec3| {
            neighbours(*place).iter().all(|neighbour| geometry.obstacle(*neighbour, &[SOURCE]).is_none())
        };
        for place in places().into_iter().step_by(form(3, 1)).filter(is_free) {
            let step = largest_step_db(&mesh, place, true);
            worst = worst.max(step);
            assert!(step < LARGEST_STEP_DB, "{name}, {place}: {step} dB");
        }
    }
    println!("largest step within a micrometre: {worst:.3} dB");
    let boundary = places().pop().expect("places");
    let screen = one_sheet([-3.0, 3.0], [-1.0, 1.5]);
    let (on, off) = (largest_step_db(&screen, boundary, true), largest_step_db(&screen, boundary, false));
    assert!(on < LARGEST_STEP_DB, "{on} dB");
    assert!(off > 100.0, "without edges the shadow begins at once: {off} dB");
}

/// Source and receiver exchanged, about every obstacle: the energies are the same within 0.05 dB, as docs/diffraction.md states. Paths over two edges of
/// different faces make the difference.
#[test]
fn ways_over_edges_may_be_reversed() {
    let mut worst = 0.0_f64;
    for (_, mesh) in obstacles().into_iter().filter(|(name, _)| !name.contains("panels")) {
        for place in [dvec3(5.0, 0.3, 1.1), dvec3(5.0, 0.3, 1.9), dvec3(1.0, 0.3, 1.51)] {
            let there = energies(scene(mesh.clone(), SOURCE, &[place]), true).swap_remove(0);
            let back = energies(scene(mesh.clone(), place, &[SOURCE]), true).swap_remove(0);
            let pairs = there.iter().zip(&back);
            let deviation = pairs.map(|(there, back)| (there / back - 1.0).abs()).fold(0.0, f64::max);
            worst = worst.max(deviation);
        }
    }
    println!("source and receiver exchanged over edges: {worst:.1e}");
    assert!(worst < 1.1e-2, "{worst:e}");
    let sheet = one_sheet([-3.0, 3.0], [-1.0, 1.5]);
    let there = energies(scene(sheet.clone(), SOURCE, &[dvec3(5.0, 0.3, 1.1)]), true);
    let other = energies(scene(sheet, dvec3(5.0, 0.3, 1.25), &[SOURCE]), true);
    assert!((there[0][7] / other[0][7] - 1.0).abs() > 1.1e-2, "another way by some centimetres is noticed");
}
