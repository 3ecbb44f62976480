//! Direct sound alone: e^(−mr)/(4πr²) at r/c, with and without air, omnidirectional and not.

use sonel_acoustics::{Bands, Material, Pattern};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::analytic::free_field;
use sonel_tests::{Traced, fluence};

fn black_room() -> Scene {
    let bands = Bands::octaves();
    Scene::shoebox([60.0, 50.0, 40.0], Material::uniform("black", 1.0, 0.5, bands.count()), bands)
        .with_source("source", [5.0, 6.0, 7.0])
        .with_receiver("near", [5.5, 6.0, 7.0])
        .with_receiver("far", [55.0, 41.0, 33.0])
        .with_duration(0.3)
}

fn check(scene: Scene, directivity: [f64; 2]) {
    let attenuation = scene.air_attenuation.clone();
    let places: Vec<_> = scene.receivers.iter().map(|receiver| receiver.position).collect();
    let (from, speed) = (scene.sources[0].position, scene.speed_of_sound);
    let traced = Traced::new(scene, Settings { emissions: 500, ..Settings::default() });
    let rendering = traced.render(RenderSettings::default());
    assert_eq!(rendering.arrivals.len(), 2, "nothing but the direct sound arrives");
    for (index, (place, factor)) in places.into_iter().zip(directivity).enumerate() {
        let distance = place.distance(from);
        assert!((rendering.arrivals[index].length / speed / (distance / speed) - 1.0).abs() < 1e-12);
        for (band, m) in attenuation.iter().enumerate() {
            let expected = factor * free_field(distance, *m);
            let found = fluence(&rendering, 300, index, band);
            assert!((found / expected - 1.0).abs() < 1e-6, "band {band}: {found} instead of {expected}");
        }
    }
}

#[test]
fn in_still_air() {
    check(black_room().without_air_attenuation(), [1.0, 1.0]);
}

#[test]
fn in_absorbing_air() {
    let scene = black_room();
    assert!(scene.air_attenuation[7] > 0.01);
    check(scene, [1.0, 1.0]);
}

/// A cardioid aimed along +x: 3 at 0°, 3 ((1 + cos θ) / 2)² elsewhere.
#[test]
fn from_a_cardioid() {
    let mut scene = black_room();
    scene.sources[0].directivity = Pattern::Cardioid.into();
    scene.sources[0].aim = glam::DVec3::X;
    let offset = scene.receivers[1].position - scene.sources[0].position;
    let cosine = offset.x / offset.length();
    check(scene, [3.0, 3.0 * (0.5 * (1.0 + cosine)).powi(2)]);
}
