//! Energies in a room whose edges bend packets, by rays and images of the receiver.

use sonel_map::{Settings, Spectral};
use sonel_renderer::Estimator;
use sonel_testkit::z_test::{Estimate, Within, agree};
use sonel_tests::Traced;
use sonel_tests::bent::{received, screened};

/// Images of the receiver and visibility rays carry what goes straight to the last mirror and on, spheres what is bent on the way:
/// together as much as spheres find of everything.
#[test]
fn mirrors_behind_the_last_diffuse_reflection_give_the_same_answer_by_three_estimators() {
    let scene = screened([0.2, 0.3, 0.2, 0.3], [0.4; 4], 0.6)
        .with_receiver("behind", [9.0, 2.5, 1.4])
        .with_receiver("in sight", [3.5, 6.5, 2.0]);
    let settings = Settings { emissions: 160_000, ..Settings::default() };
    let traced = Traced::bending(scene, settings);
    let spheres = received(&traced, Estimator::Sphere, 1 << 15);
    for estimator in [Estimator::Auto, Estimator::Gather] {
        for (spheres, others) in spheres.iter().zip(received(&traced, estimator, 1 << 15)) {
            for (&spheres, others) in spheres.iter().zip(others) {
                let within = Within { sigmas: 4.0, maximal_sigma: 0.05 * spheres.value };
                agree(spheres, others, within).unwrap();
                let spoilt = Estimate { value: 1.3 * others.value, ..others };
                assert!(agree(spheres, spoilt, within).is_err(), "mirrors that are counted twice");
            }
        }
    }
}

/// Bands that lead packets for one another must be heard as they are on paths of their own.
#[test]
fn bands_that_share_paths_past_edges_are_heard_as_on_their_own() {
    let scene =
        screened([0.2, 0.3, 0.2, 0.3], [0.6, 0.5, 0.7, 0.9], 1.0).with_receiver("behind", [9.0, 2.5, 1.4]);
    let settings = Settings { emissions: 40_000, ..Settings::default() };
    let shared = received(&Traced::bending(scene.clone(), settings), Estimator::Gather, 1 << 15);
    let alone = Settings { emissions: 20_000, spectral: Spectral::PerBand, seed: 2, ..settings };
    let alone = received(&Traced::bending(scene, alone), Estimator::Gather, 1 << 15);
    for (&shared, &alone) in shared[0].iter().zip(&alone[0]) {
        let within = Within { sigmas: 4.0, maximal_sigma: 0.05 * alone.value };
        agree(shared, alone, within).unwrap();
        let spoilt = Estimate { value: 1.3 * shared.value, ..shared };
        assert!(agree(spoilt, alone, within).is_err(), "a band that is weighed wrongly");
    }
}
