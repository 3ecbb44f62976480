//! Coefficients: walls that keep everything, nothing or next to nothing, and bands that have nothing in common.

use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::{CoefficientTable, Settings};
use sonel_renderer::{Estimator, PathClass, RenderSettings};
use sonel_scene::Scene;
use sonel_testkit::analytic::free_field;
use sonel_testkit::analytic::specular_box::SpecularBox;
use sonel_testkit::z_test::{Estimate, Within, within_sigmas};
use sonel_tests::estimates::{Windows, agree_in_windows, windows};
use sonel_tests::{Traced, batch_fluence, meshes};

use super::form;

const SIZE: [f64; 3] = [6.0, 5.0, 4.0];
const VOLUME: f64 = 120.0;
const SPEED: f64 = 343.0;
const SOURCE: [f64; 3] = [1.5, 1.2, 1.3];
const RECEIVER: [f64; 3] = [4.2, 3.7, 2.1];

/// A scene of `mesh` with two bands, without air.
fn scene(mesh: Mesh, materials: Vec<Material>, duration: f64) -> Scene {
    let bands = Bands::new(vec![500.0, 1000.0], BandWidth::Octave).expect("two octaves");
    let mut scene = Scene::from_parts(mesh, materials, bands, duration)
        .with_source("source", SOURCE)
        .with_receiver("receiver", RECEIVER)
        .without_air_attenuation();
    scene.speed_of_sound = SPEED;
    scene
}

fn material(absorption: [f64; 2], scattering: [f64; 2]) -> Material {
    Material {
        absorption: absorption.to_vec(),
        scattering: scattering.to_vec(),
        ..Material::uniform("wall", 0.0, 0.0, 2)
    }
}

fn even_box(absorption: [f64; 2], scattering: [f64; 2], duration: f64) -> Scene {
    scene(Mesh::shoebox(SIZE, [0; 6]), vec![material(absorption, scattering)], duration)
}

fn settings(emissions: u64) -> Settings {
    Settings { emissions, ..Settings::default() }
}

/// Largest deviation of late windows from an even field, Σ F = c Δt / V, in standard errors.
fn unevenness(absorption: f64) -> f64 {
    let borders = [0.0, 0.2, 0.3, 0.4, 0.5];
    let traced = Traced::new(even_box([absorption; 2], [0.5, 1.0], 0.5), settings(form(2_000, 100_000)));
    let received = windows(&traced, RenderSettings::default(), &borders).swap_remove(0);
    let expected = SPEED * 0.1 / VOLUME;
    let late = received.iter().flat_map(|windows| &windows[1..]);
    late.map(|window| {
        assert!(window.sigma < 0.02 * expected, "too noisy to mean anything: {window:?}");
        (window.value - expected).abs() / window.sigma
    })
    .fold(0.0, f64::max)
}

/// α = 0: nothing is lost and in the end the energy is the same everywhere.
#[test]
fn a_lossless_room_fills_evenly() {
    let (kept, lost) = (unevenness(0.0), unevenness(0.02));
    println!("even field of a lossless room: {kept:.1} standard errors");
    assert!(kept < 4.0, "{kept}");
    assert!(lost > 10.0, "two per cent at each arrival are noticed: {lost}");
}

/// Fluence by reflection and by the direct sound, in band 0.
fn reflected(absorption: f64, seed: u64) -> (Estimate, f64) {
    let traced = Traced::new(
        even_box([absorption; 2], [0.5, 1.0], 0.3),
        Settings { seed, ..settings(form(4_000, 100_000)) },
    );
    let rendering = traced.render(RenderSettings::default());
    let brought = |class: PathClass| rendering.classes[class as usize].1[0];
    let reflections = PathClass::ALL.into_iter().filter(|class| *class != PathClass::Direct);
    let (_, sigma) = batch_fluence(&rendering, 0, 0);
    (Estimate { value: reflections.map(brought).sum(), sigma }, brought(PathClass::Direct))
}

/// α = 1: the direct sound alone; α = 0.999999: a millionth of what the first reflections bring.
#[test]
fn black_walls_reflect_what_they_are_told() {
    let distance = glam::DVec3::from(SOURCE).distance(RECEIVER.into());
    let (nothing, direct) = reflected(1.0, 1);
    assert!((direct / free_field(distance, 0.0) - 1.0).abs() < 1e-12);
    assert!(nothing.value.abs() < 1e-300, "{nothing:?}");
    let (dark, _) = reflected(1.0 - 1e-6, 2);
    let (darker, _) = reflected(1.0 - 1e-4, 3);
    let ratio = dark.value / darker.value;
    let sigma = ratio * dark.relative_sigma().hypot(darker.relative_sigma());
    println!("reflections at α = 1 - 1e-6 against 1 - 1e-4: {ratio:.6} ± {sigma:.6}");
    within_sigmas(Estimate { value: ratio, sigma }, 0.01, Within { sigmas: 4.0, maximal_sigma: 5e-4 })
        .expect("in proportion");
}

/// α = 1e-12 takes the paths of α = 0 and 1e-12 of the energy at each arrival.
#[test]
fn absorption_far_below_rounding_does_nothing_else() {
    let (none, _) = reflected(0.0, 1);
    let (little, _) = reflected(1e-12, 1);
    let deviation = (little.value / none.value - 1.0).abs();
    println!("α = 1e-12 against 0: {deviation:.1e}");
    assert!(deviation < 1e-9, "{deviation:e}");
}

/// s = 0 and s = 1 in one material: the classes are kept apart, and each band is what it is alone.
#[test]
fn mirrors_and_lambert_walls_share_a_material() {
    let emissions = form(20_000, 60_000);
    let borders = [0.0, 0.03, 0.08, 0.16, 0.3];
    let received = |scattering: [f64; 2], seed: u64| {
        let scene = even_box([0.2; 2], scattering, 0.3);
        let traced = Traced::new(scene, Settings { seed, ..settings(emissions) });
        let rendering = traced.render(RenderSettings::default());
        (windows(&traced, RenderSettings::default(), &borders).swap_remove(0), rendering.classes)
    };
    let (both, classes) = received([0.0, 1.0], 1);
    for (class, energy) in &classes {
        let forbidden = match class {
            PathClass::Direct => continue,
            PathClass::ImageSource | PathClass::LateSpecular => 1,
            _ => 0,
        };
        assert!(energy[forbidden].abs() < 1e-300, "{class:?} in band {forbidden}: {energy:?}");
    }
    let alone = [received([0.0; 2], 2).0.swap_remove(0), received([1.0; 2], 3).0.swap_remove(1)];
    for band in 0..2 {
        agree_or_die(&both[band], &alone[band], &format!("band {band}"));
    }
    let other = received([0.1; 2], 4).0.swap_remove(0);
    assert!(agree_in_windows(&both[0], &other, 0.1).is_err(), "a tenth of scattering is noticed");
}

fn agree_or_die(first: &Windows, second: &Windows, what: &str) {
    let exact = |windows: &Windows| -> Windows {
        // Where image sources own everything there is no spread: a millionth stands for their rounding.
        let least = |window: &Estimate| window.sigma.max(1e-6 * window.value.abs());
        windows.iter().map(|window| Estimate { sigma: least(window), ..*window }).collect()
    };
    let outcome = agree_in_windows(&exact(first), &exact(second), 0.1);
    assert!(outcome.is_ok(), "{what}: {outcome:?}\n{first:?}\n{second:?}");
}

/// The largest energy of a packet per energy emitted in a band, over all arrivals; and the same had every path been
/// weighted by its leading band alone.
fn largest_weights(survival: f64) -> (f64, f64) {
    let emissions = form(4_000, 100_000);
    let scene = even_box([0.01, 0.99], [0.05, 0.95], 0.5);
    let table = CoefficientTable::new(&scene.materials, 2, survival);
    let traced = Traced::new(scene, Settings { survival, ..settings(emissions) });
    let layout = traced.map.layout();
    let (mut largest, mut by_leader) = (0.0_f64, 0.0_f64);
    let mut leader = vec![[1.0_f64; 2]; emissions as usize];
    traced.for_each_segment(|emission, share, segment| {
        for band in 0..2 {
            // One of `emissions` packets carries 1/emissions of the energy, unless its weight is another.
            largest = largest.max(share * segment.energy[0][band] * emissions as f64);
            by_leader = by_leader.max(leader[emission as usize][band]);
        }
        if let Some(arrival) = segment.arrival {
            let row = table.material(0);
            let event = match arrival.event {
                sonel_map::Event::Specular => &row.specular,
                sonel_map::Event::Diffuse => &row.diffuse,
                _ => return,
            };
            let led_by = layout.lead(emission) as usize;
            for band in 0..2 {
                leader[emission as usize][band] *= event.energy[0][band] / event.probability[0][led_by];
            }
        }
    });
    (largest, by_leader)
}

/// α 0.01 against 0.99, s 0.05 against 0.95 in one material: no packet is worth more than as many packets as there are
/// bands. Weighting by the leading band alone has no bound.
#[test]
fn weights_of_bands_that_share_paths_are_bounded() {
    for survival in [0.0, 0.15, 1.0] {
        let (largest, by_leader) = largest_weights(survival);
        println!("β = {survival}: largest weight {largest:.3}, by the leading band {by_leader:.1e}");
        assert!(largest <= 2.0 + 1e-9, "β = {survival}: {largest}");
        assert!(by_leader > 4.0, "β = {survival}: {by_leader}");
    }
}

/// A strip of the floor, `width` [m] wide, that swallows everything in a lossless hall of Lambert walls: ratio of the
/// energies in 3 … 4 s and 1 … 2 s, and what Sabine predicts for it, exact for a strip that is small. In
/// a corner it would not be: the wall beside a strip sees it and sends it less.
fn decay_by_a_strip(width: f64) -> (Estimate, f64) {
    let mut mesh = Mesh::shoebox(SIZE, [0; 6]);
    mesh.triangles
        .retain(|triangle| triangle.corners.iter().any(|&corner| mesh.vertices[corner as usize].z > 0.0));
    let corner = |x: f64, y: f64| glam::DVec3::new(x, y, 0.0);
    for (material, from, to) in [(0, 0.0, 3.0), (1, 3.0, 3.0 + width), (0, 3.0 + width, SIZE[0])] {
        let floor = [corner(from, 0.0), corner(to, 0.0), corner(to, SIZE[1]), corner(from, SIZE[1])];
        meshes::add_quad(&mut mesh, material, floor);
    }
    let materials = vec![material([0.0; 2], [1.0; 2]), material([1.0; 2], [1.0; 2])];
    let traced = Traced::new(scene(mesh, materials, 4.0), settings(form(1_000, 20_000)));
    assert!(traced.ledger.worst_residual() < 1e-9);
    let settings = RenderSettings { estimator: Estimator::Connection, ..RenderSettings::default() };
    let received = windows(&traced, settings, &[0.0, 1.0, 2.0, 3.0, 4.0]).swap_remove(0).swap_remove(0);
    let value = received[3].value / received[1].value;
    let sigma = value * received[3].relative_sigma().hypot(received[1].relative_sigma());
    let rate = SPEED * width * SIZE[1] / (4.0 * VOLUME);
    (Estimate { value, sigma }, (-2.0 * rate).exp())
}

/// One absorbing strip in a lossless hall: energy goes where it must, and no sooner.
#[test]
fn one_absorbing_strip_empties_a_lossless_hall() {
    let within = Within { sigmas: 4.0, maximal_sigma: form(0.04, 0.01) };
    let (ratio, expected) = decay_by_a_strip(0.05);
    println!("decay by a strip: {:.4} ± {:.4}, Sabine {expected:.4}", ratio.value, ratio.sigma);
    within_sigmas(ratio, expected, within).expect("Sabine");
    let (twice, _) = decay_by_a_strip(0.1);
    assert!(within_sigmas(twice, expected, within).is_err(), "a strip twice as wide is noticed");
}

/// Box 10 × 8 × 3 m, α 0.05, floor 0.6, mirrors everywhere: late sound runs along the walls and no formula of
/// reverberation predicts it. Image sources do, to the end; chains that lose much are left to spheres.
#[test]
fn an_absorbing_floor_among_mirrors_decays_as_its_images() {
    const HALL: [f64; 3] = [10.0, 8.0, 3.0];
    let duration = 1.0;
    let mesh = Mesh::shoebox(HALL, [0, 0, 0, 0, 1, 0]);
    let materials = vec![material([0.05; 2], [0.0; 2]), material([0.6; 2], [0.0; 2])];
    let traced = Traced::new(scene(mesh, materials, duration), settings(form(20_000, 400_000)));
    let exact = |floor: f64| {
        let reflection = [0.95, 0.95, 0.95, 0.95, 1.0 - floor, 0.95];
        let room = SpecularBox { size: HALL, reflection, speed_of_sound: SPEED, air_attenuation: 0.0 };
        room.echogram(SOURCE, RECEIVER, 0.001, 1000)
    };
    let borders = [0.0, 0.05, 0.1, 0.2, 0.4, 0.7, duration];
    let received = windows(&traced, RenderSettings::default(), &borders).swap_remove(0).swap_remove(0);
    let judge = |echogram: &[f64]| -> Vec<String> {
        let mut wrong = Vec::new();
        for (window, ends) in received.iter().zip(borders.windows(2)) {
            let [from, to] = [ends[0], ends[1]].map(|time| (time * 1000.0).round() as usize);
            let expected: f64 = echogram[from..to].iter().sum();
            let window = Estimate { sigma: window.sigma.max(1e-6 * window.value), ..*window };
            let within = Within { sigmas: 4.0, maximal_sigma: 1e-3 * expected };
            println!(
                "{ends:?} s: {:.5} ± {:.1e} of the images",
                window.value / expected,
                window.sigma / expected
            );
            wrong.extend(within_sigmas(window, expected, within).err().map(|error| error.to_string()));
        }
        wrong
    };
    let wrong = judge(&exact(0.6));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(judge(&exact(0.55)).len() > 2, "a floor of another absorption is noticed");
}
