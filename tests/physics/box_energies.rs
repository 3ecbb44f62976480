//! Box 6 × 5 × 4 m, α = 0.2: total fluence at a receiver against independent references (docs/physics.md §8).

use sonel_acoustics::{Bands, Material};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
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

fn check(scattering: f64, expected: f64) {
    let traced = Traced::new(room(scattering), Settings::default());
    assert!(traced.books.worst_residual() < 1e-9);
    let rendering = traced.render(RenderSettings::default());
    let bins = 1500;
    let level = 10.0 * (fluence(&rendering, bins, 0, 3) / expected).log10();
    let (mean, error) = batch_fluence(&rendering, 8, 0, 3);
    let error_db = 10.0 * (1.0 + error / mean).log10();
    println!("s = {scattering}: {level:+.4} dB ± {error_db:.4} K = {} r = {:?} {:?}", rendering.mirror_order, rendering.sphere_radius, rendering.classes.iter().map(|c| c.1[3]).collect::<Vec<_>>());
    assert!(error_db < 0.03, "too noisy to mean anything: {error_db}");
    assert!(level.abs() < 0.05, "{level} dB off");
}

#[test]
fn diffuse_walls() {
    check(1.0, 0.10164);
}

#[test]
fn mixed_walls() {
    check(0.5, 0.10102);
}

#[test]
fn mirrors() {
    check(0.0, 0.100_788);
}
