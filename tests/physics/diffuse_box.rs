//! Box with Lambert walls of six absorptions against its radiosity solution: steady state, irradiance of every wall, decay.
//!
//! The solution is that of docs/physics.md §8 for boxes; its own error, from the division into patches, is about 1e-3.

use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::{Mesh, Side};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::analytic::diffuse_box::{DiffuseBox, DividedBox, extrapolate};
use sonel_testkit::decay::reverberation_time;
use sonel_testkit::z_test::{Disagreement, Estimate, Within, within_sigmas};
use sonel_tests::{Traced, batch_fluence};

const SIZE: [f64; 3] = [6.0, 5.0, 4.0];
const SOURCE: [f64; 3] = [1.5, 1.2, 1.3];
const RECEIVER: [f64; 3] = [4.2, 3.7, 2.1];
const ABSORPTION: [f64; 6] = [0.1, 0.35, 0.2, 0.3, 0.15, 0.5];
const SPEED: f64 = 343.0;
const DURATION: f64 = 1.0;
/// Error of the radiosity solution.
const DIVISION_ERROR: f64 = 1e-3;

fn traced(absorption: [f64; 6]) -> Traced {
    let walls = absorption.map(|absorption| Material::uniform("wall", absorption, 1.0, 1));
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave band");
    let mut scene =
        Scene::from_parts(Mesh::shoebox(SIZE, [0, 1, 2, 3, 4, 5]), walls.to_vec(), bands, DURATION)
            .with_source("source", SOURCE)
            .with_receiver("receiver", RECEIVER)
            .without_air_attenuation();
    scene.speed_of_sound = SPEED;
    Traced::new(scene, Settings { emissions: 64_000, ..Settings::default() })
}

/// The same quantity of the box divided coarsely and finely, extrapolated.
fn exact(absorption: [f64; 6], quantity: impl Fn(&DividedBox) -> f64) -> f64 {
    let room = DiffuseBox { size: SIZE, absorption, speed_of_sound: SPEED };
    let [coarse, fine] = [4, 8].map(|cells| quantity(&room.divide([cells; 3])));
    extrapolate(coarse, fine)
}

/// Within four standard errors, each of which includes the error of the solution.
fn compare(estimate: Estimate, expected: f64, largest_error: f64) -> Result<(), Disagreement> {
    let sigma = estimate.sigma.hypot(DIVISION_ERROR / 2.0 * expected);
    let within = Within { sigmas: 4.0, maximal_sigma: largest_error * expected };
    within_sigmas(Estimate { sigma, ..estimate }, expected, within)
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn steady_state_at_the_receiver() {
    let (value, sigma) = batch_fluence(&traced(ABSORPTION).render(RenderSettings::default()), 0, 0);
    let fluence = |absorption| exact(absorption, |divided| divided.total_fluence(SOURCE, RECEIVER));
    compare(Estimate { value, sigma }, fluence(ABSORPTION), 0.003).unwrap();
    let mut wrong = ABSORPTION;
    wrong.swap(4, 5);
    assert!(
        compare(Estimate { value, sigma }, fluence(wrong), 0.003).is_err(),
        "floor and ceiling exchanged"
    );
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn irradiance_of_every_wall() {
    let traced = traced(ABSORPTION);
    let layout = traced.map.layout();
    let mut energy = vec![[0.0; 6]; layout.batches as usize];
    let surfaces = traced.geometry.surfaces();
    traced.for_each_segment(|emission, _, segment| {
        if let Some(arrival) = segment.arrival {
            assert_eq!(arrival.side, Side::Front);
            // Materials are numbered as walls are.
            let wall = surfaces[arrival.surface.0 as usize].material as usize;
            energy[layout.batch(emission) as usize][wall] += segment.energy[0][0];
        }
    });
    for wall in 0..6 {
        let estimate = Estimate::of(&energy.iter().map(|batch| batch[wall]).collect::<Vec<_>>());
        let expected = exact(ABSORPTION, |divided| divided.incident_on_walls(SOURCE)[wall]);
        compare(estimate, expected, 0.005).unwrap();
        let opposite = exact(ABSORPTION, |divided| divided.incident_on_walls(SOURCE)[wall ^ 1]);
        assert!(compare(estimate, opposite, 0.005).is_err(), "wall {wall} taken for the one opposite");
    }
}

/// The slope of the late decay is the eigenvalue of the exchange: to half a percent, and Eyring's is further off.
#[test]
fn late_decay_is_the_eigenvalue() {
    let rendering = traced(ABSORPTION).render(RenderSettings::default());
    let energies: Vec<f64> = (0..1000).map(|bin| rendering.total.get(0, bin, 0)).collect();
    let time = reverberation_time(&energies, 0.001, -15.0, -45.0);
    let expected = exact(ABSORPTION, DividedBox::reverberation_time);
    assert!((time / expected - 1.0).abs() < 0.005, "{time} s instead of {expected} s");
    let [x, y, z] = SIZE;
    let areas = [y * z, y * z, x * z, x * z, x * y, x * y];
    let area: f64 = areas.iter().sum();
    let mean = areas.iter().zip(ABSORPTION).map(|(area, absorption)| area * absorption).sum::<f64>() / area;
    let eyring = 24.0 * std::f64::consts::LN_10 * x * y * z / (-SPEED * area * (1.0 - mean).ln());
    assert!((eyring / expected - 1.0).abs() > 0.01, "{eyring} s");
}
