//! Energies in a room whose edges bend packets, by two estimators.
//! Other estimators are in [`crate::bending`].

use sonel_map::Settings;
use sonel_renderer::Estimator;
use sonel_testkit::z_test::{Within, agree, within_sigmas};
use sonel_tests::Traced;
use sonel_tests::bent::{received, screened};

/// Emissions of a run.
const EMISSIONS: u64 = 400_000;
/// Rays of a receiver.
const RAYS: u32 = 1 << 15;
/// Largest joint standard error, as a part of the energy.
const ERROR: f64 = 0.05;

/// Energy at receiver 0 of connections that no edge takes anything from, and of spheres of `radius` for what was bent since its
/// last diffuse reflection: counted straight and bent.
fn counted_twice(traced: &Traced, radius: f64) -> [f64; 4] {
    let scene = &traced.map.header().scene;
    let receiver = scene.receivers[0].position - traced.geometry.center();
    let diffuse: Vec<f64> = (0..4).map(|band| scene.materials[0].diffuse(band)).collect();
    let mut sums = [0.0; 4];
    traced.for_each_segment(|_, share, segment| {
        let (from, to) = (segment.start.as_dvec3(), segment.end.as_dvec3());
        let along = to - from;
        let at = (receiver - from).dot(along) / along.length_squared();
        let crosses = (0.0..1.0).contains(&at) && from.lerp(to, at).distance(receiver) < radius;
        if segment.history.bends > 0 && segment.history.diffused && crosses {
            for (sum, energy) in sums.iter_mut().zip(segment.energy[0]) {
                *sum += share * energy / (std::f64::consts::PI * radius * radius);
            }
        }
        let Some(arrival) = segment.arrival else { return };
        let offset = receiver - to;
        let normal = arrival.side.sign() * traced.geometry.surface(arrival.surface).normal;
        let departure = traced.geometry.leave(segment.end, arrival.surface, arrival.side);
        if offset.dot(normal) > 0.0 && !traced.geometry.is_blocked(departure, receiver.as_vec3()) {
            let solid = offset.dot(normal) / offset.length().powi(3) / std::f64::consts::PI;
            for band in 0..4 {
                sums[band] += share * segment.energy[0][band] * diffuse[band] * solid;
            }
        }
    });
    sums
}

/// What every packet brings to spheres must be what connections say of straight last ways and spheres of bent ones. Everything
/// is scattered, so that all but the direct sound is compared.
#[test]
fn a_screen_in_a_reverberant_room_gives_the_same_answer_by_two_estimators() {
    let scene = screened([0.2, 0.3, 0.2, 0.3], [1.0; 4], 1.0)
        .with_receiver("behind", [9.0, 2.5, 1.4])
        .with_receiver("in sight", [3.5, 6.5, 2.0]);
    let settings = Settings { emissions: EMISSIONS, ..Settings::default() };
    let traced = Traced::bending(scene, settings);
    let (spheres, connections) =
        (received(&traced, Estimator::Sphere, RAYS), received(&traced, Estimator::Connection, RAYS));
    for (spheres, connections) in spheres.iter().zip(&connections) {
        for (&spheres, &connections) in spheres.iter().zip(connections) {
            let within = Within { sigmas: 4.0, maximal_sigma: ERROR * spheres.value };
            agree(spheres, connections, within).unwrap();
        }
    }
    let twice = counted_twice(&traced, 0.5);
    for band in 0..2 {
        let within = Within { sigmas: 4.0, maximal_sigma: f64::INFINITY };
        assert!(within_sigmas(spheres[0][band], twice[band], within).is_err(), "counted straight and bent");
    }
}
