//! Air: 8 kHz over kilometres, arctic and tropical, dry and saturated.

use sonel_acoustics::{Air, Bands, Material};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::analytic::specular_box::SpecularBox;
use sonel_tests::Traced;
use sonel_tests::airs::with_air;

use super::form;

const SIZE: [f64; 3] = [4000.0, 3000.0, 2500.0];
const SOURCE: [f64; 3] = [100.0, 200.0, 300.0];
const RECEIVER: [f64; 3] = [3800.0, 2700.0, 2100.0];

/// Largest relative deviation of direct sound and image-source paths from images in air of `times` the attenuation, in a hall
/// of kilometres: levels down to 1e-200.
fn deviation(air: Air, times: f64) -> (f64, f64) {
    let bands = Bands::octaves();
    let count = bands.count();
    let scene = Scene::shoebox(SIZE, Material::uniform("walls", 0.1, 0.0, count), bands)
        .with_source("source", SOURCE)
        .with_receiver("receiver", RECEIVER)
        .with_duration(45.0);
    let scene = with_air(scene, air);
    let (attenuation, speed_of_sound) = (scene.air_attenuation.clone(), scene.speed_of_sound);
    let traced = Traced::new(scene, Settings { emissions: 64, ..Settings::default() });
    let settings = RenderSettings { mirror_order: Some(2), bin: 0.01, ..RenderSettings::default() };
    let found = traced.render(settings).arrivals;
    let (mut worst, mut least) = (0.0_f64, f64::INFINITY);
    for (band, m) in attenuation.iter().enumerate() {
        let room =
            SpecularBox { size: SIZE, reflection: [0.9; 6], speed_of_sound, air_attenuation: times * m };
        let expected = room.arrivals_to_order(SOURCE, RECEIVER, 2);
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found.length / speed_of_sound / expected.time - 1.0).abs() < 1e-9);
            worst = worst.max((found.energy[band] / expected.fluence - 1.0).abs());
            least = least.min(expected.fluence);
        }
    }
    (worst, least)
}

/// Every arrival to 1e-6 over kilometres of air, where 8 kHz has lost hundreds of decibels.
#[test]
fn eight_kilohertz_over_kilometres() {
    let dry = Air { temperature_celsius: 10.0, relative_humidity_percent: 20.0, ..Air::default() };
    for air in form(vec![dry], vec![dry, Air::default()]) {
        let (worst, least) = deviation(air, 1.0);
        println!("kilometres of air: {worst:.1e}, down to {least:.1e} 1/m²");
        assert!(worst < 1e-6, "{worst:e}");
        assert!(least < 1e-60, "{least:e}");
        assert!(deviation(air, 1.0 + 1e-6).0 > 1e-6, "a millionth more attenuation is noticed");
    }
}

/// The whole range of temperature, humidity and pressure: attenuation is positive and finite, and grows with frequency.
#[test]
fn attenuation_is_sound_in_all_air() {
    let steps = form(8, 60);
    let between = |low: f64, high: f64, step: u32| low + (high - low) * f64::from(step) / f64::from(steps);
    let bands = Bands::octaves();
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for t in 0..=steps {
        for h in 0..=steps {
            for p in 0..=steps {
                let air = Air {
                    temperature_celsius: between(-20.0, 50.0, t),
                    relative_humidity_percent: between(0.0, 100.0, h),
                    pressure_kpa: between(10.0, 200.0, p),
                };
                assert!(air.problems().is_empty());
                let attenuation =
                    (0..bands.count()).map(|band| air.energy_attenuation(bands.exact_midband(band)));
                let attenuation: Vec<f64> = attenuation.collect();
                assert!(attenuation.windows(2).all(|pair| 0.0 < pair[0] && pair[0] < pair[1]), "{air:?}");
                assert!(air.density() > 0.0 && air.speed_of_sound() > 0.0, "{air:?}");
                (least, most) = (least.min(attenuation[0]), most.max(attenuation[7]));
            }
        }
    }
    println!("m from {least:.1e} to {most:.1e} per metre");
    assert!(most < 1.0, "{most}");
}
