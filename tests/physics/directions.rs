//! Energies by direction in every estimator: against receivers with the pattern of each weight, against exact lateral fractions, and in a
//! diffuse field.

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material, Pattern};
use sonel_analysis::{Parameter, parameters};
use sonel_echogram::Response;
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::{Estimator, RenderError, RenderSettings};
use sonel_scene::{Receiver, Scene};
use sonel_testkit::z_test::{Variance, z_test};
use sonel_tests::{Traced, meshes};

/// Rate at which sound statistics would be rejected.
const FALSE_ALARM: f64 = 1e-4;

fn bands() -> Bands {
    Bands::new(vec![250.0, 500.0], BandWidth::Octave).expect("octaves")
}

/// A box of six materials, in the order −x, +x, −y, +y, −z, +z, with a receiver that looks along −x: its lateral axis is y.
fn room(absorption: [f64; 6], scattering: f64) -> Scene {
    let mesh = Mesh::shoebox([15.0, 12.0, 9.0], [0, 1, 2, 3, 4, 5]);
    let walls = absorption.map(|absorption| Material::uniform("wall", absorption, scattering, 2)).to_vec();
    let mut scene = Scene::from_parts(mesh, walls, bands(), 0.25).without_air_attenuation();
    scene = scene.with_source("source", [3.0, 5.0, 3.9]).with_receiver("receiver", [11.0, 6.0, 3.3]);
    scene.receivers[0].aim = DVec3::NEG_X;
    scene
}

fn traced(scene: Scene, emissions: u64) -> Traced {
    Traced::new(scene, Settings { emissions, batches: 8, ..Settings::default() })
}

fn with_directions(estimator: Estimator) -> RenderSettings {
    RenderSettings { rays: Some(4_096), directions: true, ..RenderSettings::of(estimator) }
}

/// Lateral energy, lateral cross energy and the moment of the only receiver in band 0, over all time.
fn sums(response: &Response) -> (f64, f64, DVec3) {
    let directions = response.directions.as_ref().expect("directions");
    let bins = response.bins();
    let [lateral, cross] = [0, 1].map(|which| directions.lateral[which].energy[..bins].iter().sum());
    let moment = directions.moment[..3 * bins].chunks_exact(3);
    let moment = moment.fold(DVec3::ZERO, |sum, vector| sum + DVec3::from_slice(vector));
    (lateral, cross, moment)
}

/// The energy of the receiver in band 0 if it had `pattern` along `aim`.
fn received(traced: &Traced, estimator: Estimator, pattern: Pattern, aim: DVec3) -> f64 {
    let position = traced.map.header().scene.receivers[0].position;
    let receiver = Receiver { name: "pattern".to_owned(), position, aim, pattern };
    let settings = RenderSettings { directions: false, edges: traced.edges, ..with_directions(estimator) };
    let receivers = [(&receiver).into()];
    let silent = &sonel::Silent;
    let received =
        sonel::study::pipeline::render_and_read(&traced.map, &traced.geometry, &receivers, &settings, silent);
    received.expect("a sound receiver").0.response.echogram(0, 0, 0).iter().sum()
}

/// A parameter of eight along the lateral axis takes the lateral energy, and cardioids along an axis and against it, ((1 + c)² − (1 − c)²)/4 = c,
/// differ by the moment: the same sound through code of its own. Visibility rays of a pattern end by roulette of their own.
#[test]
#[ignore = "long: cargo xtask accept"]
fn directions_are_what_receivers_with_these_patterns_take() {
    let cases = [
        (false, Estimator::Auto, 1e-3),
        (false, Estimator::Connection, 1e-9),
        (false, Estimator::Sphere, 1e-9),
        (true, Estimator::Connection, 1e-9),
        (true, Estimator::Gather, 0.01),
    ];
    for (is_screened, estimator, tolerance) in cases {
        let mut scene = room([0.3; 6], 0.3);
        if is_screened {
            let corners = [[7.5, 2.4, 1.2], [7.5, 7.8, 1.2], [7.5, 7.8, 5.7], [7.5, 2.4, 5.7]];
            meshes::add_quad(&mut scene.mesh, 0, corners.map(DVec3::from_array));
        }
        let traced = traced(scene, 500);
        let (lateral, cross, moment) = sums(&traced.respond(with_directions(estimator)));
        let omni = received(&traced, estimator, Pattern::Omni, DVec3::X);
        let eight = received(&traced, estimator, Pattern::FigureEight, DVec3::Y);
        let close = |a: f64, b: f64| (a - b).abs() < tolerance * omni;
        assert!(close(lateral, eight), "{estimator:?} {is_screened}: {lateral} {eight} of {omni}");
        assert!(!close(lateral, cross) && cross < omni, "{estimator:?}: another weight passes");
        let axis = dvec3(-0.6, 0.48, 0.64);
        let take = |aim| received(&traced, estimator, Pattern::Cardioid, aim);
        let (found, expected) = (moment.dot(axis), take(axis) - take(-axis));
        assert!(close(found, expected), "{estimator:?} {is_screened}: {found} {expected} of {omni}");
        assert!(!close(found, -expected), "{estimator:?}: the other sign passes");
    }
}

/// Direct sound from ahead and one wall at the side: LF and LFC in closed form, and a lateral axis that the source gives.
#[test]
fn one_lateral_reflection_has_its_exact_fractions() {
    let scene = room([1.0, 1.0, 1.0, 0.0, 1.0, 1.0], 0.0);
    let offset = |source: DVec3| source - scene.receivers[0].position;
    let source = scene.sources[0].position;
    let (direct, image) = (offset(source), offset(dvec3(source.x, 24.0 - source.y, source.z)));
    let delay = (image.length() - direct.length()) / scene.speed_of_sound;
    assert!((0.006..0.079).contains(&delay), "{delay} s");
    let share =
        image.length_squared().recip() / (image.length_squared().recip() + direct.length_squared().recip());
    for axis in [DVec3::Y, DVec3::Z.cross(direct).normalize()] {
        let mut scene = scene.clone();
        scene.receivers[0].aim = axis.cross(DVec3::Z);
        let response = traced(scene, 100).respond(with_directions(Estimator::Auto));
        let parameters = &parameters(&response)[0].bands[0];
        let value = |parameter| parameters.parameter(parameter).as_ref().expect("a fraction").value;
        let cosine = axis.dot(image.normalize()).abs();
        for (parameter, expected) in [
            (Parameter::LateralFraction, cosine * cosine * share),
            (Parameter::LateralFractionCosine, cosine * share),
        ] {
            let found = value(parameter);
            assert!((found - expected).abs() < 1e-9, "{parameter:?}: {found} instead of {expected}");
        }
    }
}

/// By batch, which shares of what arrives after 100 ms in a box that scatters everything and absorbs little are lateral.
fn late_shares() -> [Vec<f64>; 2] {
    let response = traced(room([0.02; 6], 1.0), 4_000).respond(with_directions(Estimator::Auto));
    let edges = response.batch_edges(0, 0).expect("batches");
    let first = edges.partition_point(|edge| *edge < response.direct_time(0, 0) + 0.1);
    let late = |response: &Response, g: usize| -> f64 {
        let batch = response.batch_echogram(g, 0, 0, 0).expect("a batch");
        batch[first..].iter().map(|energy| f64::from(*energy)).sum()
    };
    [0, 1].map(|which| {
        let lateral = response.lateral(which).expect("directions");
        (0..8).map(|g| late(&lateral, g) / late(&response, g)).collect()
    })
}

/// Mean of cos² over the sphere 1/3, of |cos| 1/2; each is rejected for the other.
#[test]
fn a_third_of_a_diffuse_field_is_lateral() {
    let [squares, cosines] = late_shares();
    let p = |shares: &[f64], mean| z_test(shares, mean, Variance::Estimated);
    assert!(
        p(&squares, 1.0 / 3.0) > FALSE_ALARM && p(&cosines, 0.5) > FALSE_ALARM,
        "{squares:?} {cosines:?}"
    );
    assert!(p(&squares, 0.5) < FALSE_ALARM && p(&cosines, 1.0 / 3.0) < FALSE_ALARM);
}

/// A receiver that is not omnidirectional or looks up has no lateral energy.
#[test]
fn receivers_without_a_lateral_axis_are_refused_by_name() {
    let mut scene = room([0.3; 6], 0.3);
    scene.receivers[0].aim = DVec3::Z;
    scene = scene.with_receiver("mic", [9.0, 6.0, 3.3]);
    scene.receivers[1].pattern = Pattern::Cardioid;
    let traced = traced(scene, 100);
    let settings = with_directions(Estimator::Auto);
    let receivers = sonel::study::response::receivers_of(&traced.map.header().scene);
    let renderer = traced.renderer(settings);
    let Err(RenderError::Receivers(problems)) = renderer.check_receivers(&receivers) else {
        panic!("both are refused");
    };
    assert_eq!(problems.len(), 2, "{problems:?}");
    assert!(problems[0].contains("\"receiver\" aims straight up") && problems[1].contains("cardioid"));
}
