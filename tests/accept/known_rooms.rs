//! Rooms whose parameters are known, with noise well below their tolerances (docs/physics.md §8).

use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_analysis::{Parameter, ReceiverParameters, parameters};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::analytic::diffuse_box::{DiffuseBox, DividedBox, extrapolate};
use sonel_tests::{Traced, shipped};

const SPEED: f64 = 343.0;

/// One band at 1 kHz in a box of equal walls of α = 0.2, without air.
fn even_box(size: [f64; 3], scattering: f64, [source, receiver]: [[f64; 3]; 2], duration: f64) -> Scene {
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave band");
    let mut scene = Scene::shoebox(size, Material::uniform("walls", 0.2, scattering, 1), bands)
        .with_source("source", source)
        .with_receiver("receiver", receiver)
        .with_duration(duration)
        .without_air_attenuation();
    scene.speed_of_sound = SPEED;
    scene
}

fn rendered(scene: Scene, emissions: u64) -> Vec<ReceiverParameters> {
    let traced = Traced::new(scene, Settings { emissions, ..Settings::default() });
    parameters(&traced.respond(RenderSettings::default()))
}

/// A parameter that must be: value, largest deviation. Its interval must be narrower than half that deviation.
fn check(parameters: &[ReceiverParameters], band: usize, expectations: &[(Parameter, f64, f64)]) {
    for &(parameter, expected, tolerance) in expectations {
        let estimate = parameters[0].bands[band].parameter(parameter).as_ref().expect("a supported figure");
        let [low, high] = *estimate.interval.as_ref().expect("an interval");
        println!("{parameter:?}: {:.5} in [{low:.5}, {high:.5}], expected {expected}", estimate.value);
        assert!(high - low < tolerance, "{parameter:?}: too wide to mean anything");
        assert!((estimate.value - expected).abs() < tolerance, "{parameter:?}");
    }
}

fn strength(fluence: f64) -> f64 {
    10.0 * (400.0 * std::f64::consts::PI * fluence).log10()
}

#[test]
fn small_boxes() {
    let places = [[1.5, 1.2, 1.3], [4.2, 3.7, 2.1]];
    let scattered = [
        (
            1.0,
            vec![
                (Parameter::Strength, strength(0.101_614), 0.02),
                (Parameter::T30, 0.611, 0.003),
                (Parameter::ClarityC80, 6.89, 0.05),
            ],
        ),
        (
            0.5,
            vec![
                (Parameter::Strength, strength(0.101_02), 0.02),
                (Parameter::T30, 0.600_8, 0.003),
                (Parameter::EarlyDecayTime, 0.597, 0.003),
                (Parameter::ClarityC80, 7.25, 0.05),
            ],
        ),
    ];
    for (scattering, expectations) in scattered {
        let parameters = rendered(even_box([6.0, 5.0, 4.0], scattering, places, 1.5), 1_000_000);
        check(&parameters, 0, &expectations);
    }
}

/// T30 of 10 × 8 × 5 m within half a percent of 0.888 s, and of the time of the radiosity solution's eigenvalue.
#[test]
fn diffuse_box_of_kuttruff() {
    let size = [10.0, 8.0, 5.0];
    let places = [[2.5, 2.0, 1.5], [7.0, 5.5, 3.0]];
    let parameters = rendered(even_box(size, 1.0, places, 1.6), 1_000_000);
    let room = DiffuseBox { size, absorption: [0.2; 6], speed_of_sound: SPEED };
    let [coarse, fine] = [4, 8].map(|cells| room.divide([cells; 3]));
    let steady =
        extrapolate(coarse.total_fluence(places[0], places[1]), fine.total_fluence(places[0], places[1]));
    let late = extrapolate(DividedBox::reverberation_time(&coarse), DividedBox::reverberation_time(&fine));
    let expectations = [
        (Parameter::T30, 0.888, 0.005 * 0.888),
        (Parameter::T30, late, 0.005 * late),
        (Parameter::Strength, strength(steady), 0.02),
    ];
    check(&parameters, 0, &expectations);
}

/// The founding paper's room without diffraction.
#[test]
fn seed_room() {
    let parameters = rendered(shipped("seed-room"), 400_000);
    for band in 0..6 {
        check(
            &parameters,
            band,
            &[(Parameter::Strength, strength(1.0) - 31.48, 0.1), (Parameter::T30, 7.75, 0.1)],
        );
    }
}
