//! Box 6 × 5 × 4 m, α = 0.2: total fluence at a receiver against independent references (docs/physics.md §8).

use sonel_acoustics::{Bands, Material};
use sonel_map::Settings;
use sonel_renderer::{Estimator, RenderSettings, Rendering};
use sonel_scene::Scene;
use sonel_tests::{Traced, batch_fluence, fluence};

fn room(scattering: f64) -> Scene {
    let bands = Bands::octaves();
    let mut scene = Scene::shoebox([6.0, 5.0, 4.0], Material::uniform("walls", 0.2, scattering, 8), bands)
        .with_source("source", [1.5, 1.2, 1.3])
        .with_receiver("receiver", [4.2, 3.7, 2.1])
        .with_duration(1.5)
        .without_air_attenuation();
    scene.speed_of_sound = 343.0;
    scene
}

/// Level of the rendering over `expected` and its standard error [dB], in the 500 Hz band.
fn level_db(rendering: &Rendering, expected: f64) -> (f64, f64) {
    let (mean, error) = batch_fluence(rendering, 0, 3);
    let level = 10.0 * (fluence(rendering, 1500, 0, 3) / expected).log10();
    (level, 10.0 * (1.0 + error / mean).log10())
}

fn check(scattering: f64, expected: f64) {
    let traced = Traced::new(room(scattering), Settings { emissions: 100_000, ..Settings::default() });
    assert!(traced.ledger.worst_residual() < 1e-9);
    let (level, error) = level_db(&traced.render(RenderSettings::default()), expected);
    assert!(error < 0.012, "too noisy to mean anything: {error} dB");
    assert!(level.abs() < 0.03, "{level} dB off");
}

#[test]
fn diffuse_walls() {
    check(1.0, 0.101_64);
}

#[test]
fn mixed_walls() {
    check(0.5, 0.101_02);
}

#[test]
fn mirrors() {
    check(0.0, 0.100_788);
}

/// The same map, the same energy, several ways to count it.
#[test]
fn estimators_agree_within_their_joint_interval() {
    let traced = Traced::new(room(0.5), Settings { emissions: 30_000, ..Settings::default() });
    let levels: Vec<(f64, f64)> = Estimator::COMPARABLE
        .into_iter()
        .map(|estimator| {
            level_db(&traced.render(RenderSettings { estimator, ..Default::default() }), 0.101_02)
        })
        .collect();
    for (level, error) in &levels {
        assert!(*error < 0.16, "too noisy to mean anything: {levels:?}");
        // The sphere averages the field over its volume: its bias is below 0.02 dB here.
        assert!(level.abs() < 4.0 * error + 0.02, "{levels:?}");
    }
}
