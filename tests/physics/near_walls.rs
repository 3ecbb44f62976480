//! Receivers next to walls: as calm as in the middle of the room, and right.

use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_analysis::{Parameter, parameters};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::{Estimator, RenderSettings, Rendering};
use sonel_scene::Scene;
use sonel_testkit::z_test::{Estimate, Within, agree};
use sonel_tests::{Traced, batch_fluence};

const MIDDLE: [f64; 3] = [4.3, 3.1, 2.3];
const SOURCE: [f64; 3] = [2.1, 1.7, 1.4];
const NEAR: [[f64; 3]; 5] =
    [[0.001, 3.1, 2.3], [0.01, 3.1, 2.3], [0.01, 0.01, 2.3], [0.001, 0.001, 0.001], [0.1, 0.1, 0.1]];

fn room(
    source: [f64; 3],
    receivers: &[[f64; 3]],
    (absorption, scattering): (f64, f64),
    emissions: u64,
) -> Traced {
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("one band");
    let wall = Material::uniform("wall", absorption, scattering, 1);
    let mut scene = Scene::from_parts(Mesh::shoebox([6.0, 5.0, 4.0], [0; 6]), vec![wall], bands, 0.9)
        .with_source("source", source)
        .without_air_attenuation();
    for (number, &receiver) in receivers.iter().enumerate() {
        scene = scene.with_receiver(&number.to_string(), receiver);
    }
    Traced::new(scene, Settings { emissions, ..Settings::default() })
}

/// Half-widths of level, C80 and T30.
fn half_widths(traced: &Traced) -> Vec<[f64; 3]> {
    let response = traced.respond(RenderSettings::default());
    let half_width = |receiver: &sonel_analysis::ReceiverParameters, parameter| {
        let estimate = receiver.bands[0].parameter(parameter).as_ref().expect("a figure");
        let [low, high] = *estimate.interval.as_ref().expect("an interval");
        0.5 * (high - low)
    };
    let parameters = parameters(&response);
    let of =
        |receiver| [Parameter::Level, Parameter::ClarityC80, Parameter::T30].map(|p| half_width(receiver, p));
    parameters.iter().map(of).collect()
}

/// Next to a wall and to two of them half-widths are at most thrice those in the middle, a decimetre off three walls at most five times: there
/// levels of eight seeds scatter by 0.049 dB, in the middle by 0.015 dB. What connections alone, tiny spheres or discs make of it is ten times the
/// middle's and more. Half-widths of 32 batches scatter by 13 %.
#[test]
#[ignore = "long: cargo xtask accept"]
fn next_to_walls_intervals_are_at_most_a_few_times_as_wide() {
    for walls in [(0.2, 0.5), (0.1, 0.1)] {
        let receivers: Vec<[f64; 3]> = [MIDDLE].into_iter().chain(NEAR).collect();
        let found = half_widths(&room(SOURCE, &receivers, walls, 8_000));
        for (number, (place, half_widths)) in receivers.iter().zip(&found).enumerate().skip(1) {
            let most = if number == NEAR.len() { 5.0 } else { 3.0 };
            for (parameter, (near, middle)) in half_widths.iter().zip(&found[0]).enumerate() {
                assert!(near / middle < most * 1.25, "{walls:?} {place:?} {parameter}: {near} {middle}");
            }
        }
    }
}

/// A source there and a receiver in the room hear the same, by other estimators.
#[test]
fn next_to_walls_exchange_of_source_and_receiver_changes_nothing() {
    let estimate = |rendering: &Rendering, receiver| {
        let (value, sigma) = batch_fluence(rendering, receiver, 0);
        Estimate { value, sigma }
    };
    let places = [NEAR[1], NEAR[3], NEAR[4]];
    let walls = (0.2, 0.5);
    let there = room(SOURCE, &places, walls, 4_000);
    let near = there.render(RenderSettings::default());
    let gathered = there.render(RenderSettings { estimator: Estimator::Gather, ..RenderSettings::default() });
    for (index, &place) in places.iter().enumerate() {
        let back = estimate(&room(place, &[SOURCE], walls, 4_000).render(RenderSettings::default()), 0);
        for found in [&near, &gathered].map(|rendering| estimate(rendering, index)) {
            let within = Within { sigmas: 4.0, maximal_sigma: 0.02 * back.value };
            agree(found, back, within).unwrap_or_else(|off| panic!("{place:?}: {off}"));
        }
    }
}
