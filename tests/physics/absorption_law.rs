//! Locally reacting walls: an empty box against the sum over its image sources, estimators among themselves.

use std::f64::consts::PI;

use glam::{DVec3, dvec3};
use sonel_acoustics::absorption_law::{absorption_at, impedance};
use sonel_acoustics::{AbsorptionLaw, BandWidth, Bands, Material};
use sonel_map::Settings;
use sonel_renderer::{Estimator, RenderSettings};
use sonel_scene::Scene;
use sonel_testkit::z_test::{Estimate, Within, within_sigmas};
use sonel_tests::Traced;
use sonel_tests::estimates::{agree_in_windows, windows};

const SIZE: DVec3 = dvec3(5.0, 4.0, 3.0);
const SOURCE: DVec3 = dvec3(1.1, 2.7, 1.4);
const RECEIVER: DVec3 = dvec3(3.9, 1.2, 1.7);
const ABSORPTION: [f64; 2] = [0.05, 0.4];
const BORDERS: [f64; 4] = [0.0, 0.03, 0.1, 0.3];

fn room(scattering: f64) -> Scene {
    let bands = Bands::new(vec![125.0, 1000.0], BandWidth::Octave).expect("octaves");
    let mut walls = Material::uniform("walls", 0.0, scattering, 2);
    walls.absorption = ABSORPTION.to_vec();
    walls.law = AbsorptionLaw::LocallyReacting;
    Scene::shoebox(SIZE.to_array(), walls, bands)
        .with_source("source", SOURCE.to_array())
        .with_receiver("receiver", RECEIVER.to_array())
        .with_duration(BORDERS[3])
        .without_air_attenuation()
}

/// Fluence of all image sources between [`BORDERS`], each wall absorbing `absorption` of a cosine [1/m²].
fn of_images(speed: f64, absorption: impl Fn(f64) -> f64) -> [f64; 3] {
    let reach = BORDERS[3] * speed;
    let axis = |axis: usize| {
        let most = (reach / SIZE[axis]) as i32 + 2;
        (-most..=most).map(move |cell| {
            let inside = if cell % 2 == 0 { SOURCE[axis] } else { SIZE[axis] - SOURCE[axis] };
            (f64::from(cell) * SIZE[axis] + inside - RECEIVER[axis], cell.abs())
        })
    };
    let mut windows = [0.0; 3];
    for (x, y) in axis(0).flat_map(|x| axis(1).map(move |y| (x, y))) {
        for z in axis(2) {
            let offset = dvec3(x.0, y.0, z.0);
            let length = offset.length();
            if length >= reach {
                continue;
            }
            let reflected =
                [x, y, z].map(|(along, times)| (1.0 - absorption(along.abs() / length)).powi(times));
            let window =
                BORDERS[1..].iter().position(|&border| length / speed < border).expect("within reach");
            windows[window] += reflected.iter().product::<f64>() / (4.0 * PI * length * length);
        }
    }
    windows
}

/// Exact images up to some order, and packets for the rest.
#[test]
fn an_empty_box_has_the_sum_over_its_images() {
    let scene = room(0.0);
    let speed = scene.speed_of_sound;
    let traced = Traced::new(scene, Settings { emissions: 20_000, ..Settings::default() });
    assert!(traced.ledger.worst_residual() < 1e-9);
    let found = &windows(&traced, RenderSettings::default(), &BORDERS)[0];
    for (band, absorption) in ABSORPTION.into_iter().enumerate() {
        let impedance = impedance(absorption).expect("no more than the law allows");
        let expected = of_images(speed, |cosine| absorption_at(impedance, cosine));
        let uniform = of_images(speed, |_| absorption);
        let agrees = |expected: [f64; 3]| {
            found[band].iter().zip(expected).try_for_each(|(&Estimate { value, sigma }, expected)| {
                // Receiver spheres of finite size and ranges of angles are good to a thousandth.
                let sigma = sigma.max(1e-3 * expected);
                within_sigmas(
                    Estimate { value, sigma },
                    expected,
                    Within { sigmas: 4.0, maximal_sigma: 0.05 * expected },
                )
            })
        };
        agrees(expected).unwrap_or_else(|flaw| panic!("band {band}: {flaw}"));
        assert!(agrees(uniform).is_err(), "band {band}: the same absorption at every angle");
    }
}

/// One map, counted in four ways, in the room and next to a wall.
#[test]
fn estimators_agree_about_locally_reacting_walls() {
    let scene = room(0.3).with_receiver("near", [2.2, 0.04, 1.3]);
    let traced = Traced::new(scene, Settings { emissions: 12_000, ..Settings::default() });
    assert!(traced.ledger.worst_residual() < 1e-9);
    let by = |estimator| {
        windows(
            &traced,
            RenderSettings { estimator, rays: Some(16_384), ..RenderSettings::default() },
            &BORDERS,
        )
    };
    let reference = by(Estimator::Auto);
    for (estimator, largest) in
        [(Estimator::Gather, 0.1), (Estimator::Connection, 0.25), (Estimator::Sphere, 0.25)]
    {
        for (receiver, (reference, other)) in reference.iter().zip(&by(estimator)).enumerate() {
            for (band, (reference, other)) in reference.iter().zip(other).enumerate() {
                agree_in_windows(other, reference, largest)
                    .unwrap_or_else(|flaw| panic!("{estimator:?}, receiver {receiver}, band {band}: {flaw}"));
            }
        }
    }
}
