//! Locally reacting walls: an empty box against the sum over its image sources, estimators among themselves.

use std::f64::consts::PI;

use glam::{DVec3, dvec3};
use sonel_acoustics::absorption_law::{absorption_at, impedance, mean_absorption_between};
use sonel_acoustics::{AbsorptionLaw, BandWidth, Bands, Material};
use sonel_geometry::{Geometry, Mesh, SurfaceId};
use sonel_map::{CoefficientTable, Settings};
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
    let mut windows = [0.0; 3];
    visit_images(
        BORDERS[3] * speed,
        |_, cosine| absorption(cosine),
        |length, fluence| {
            let window =
                BORDERS[1..].iter().position(|&border| length / speed < border).expect("within reach");
            windows[window] += fluence;
        },
    );
    windows
}

/// Visits the length [m] and fluence [1/m²] of all image sources within `reach` [m], walls across each axis absorbing `absorption` of a cosine.
fn visit_images(reach: f64, absorption: impl Fn(usize, f64) -> f64, mut visit: impl FnMut(f64, f64)) {
    let axis = |axis: usize| {
        let most = (reach / SIZE[axis]) as i32 + 2;
        (-most..=most).map(move |cell| {
            let inside = if cell % 2 == 0 { SOURCE[axis] } else { SIZE[axis] - SOURCE[axis] };
            (f64::from(cell) * SIZE[axis] + inside - RECEIVER[axis], cell.abs())
        })
    };
    for (x, y) in axis(0).flat_map(|x| axis(1).map(move |y| (x, y))) {
        for z in axis(2) {
            let offset = dvec3(x.0, y.0, z.0);
            let length = offset.length();
            if length >= reach {
                continue;
            }
            let reflected = [x, y, z]
                .into_iter()
                .enumerate()
                .map(|(axis, (along, times))| (1.0 - absorption(axis, along.abs() / length)).powi(times));
            visit(length, reflected.product::<f64>() / (4.0 * PI * length * length));
        }
    }
}

/// Energies that packets have along the paths to image sources give the T30 of the exact sum, also where sound stays between two walls. The
/// mean of an eighth octave of the cosine, which packets once took, does not.
#[test]
#[ignore = "long: cargo xtask accept"]
fn paths_between_parallel_walls_decay_as_their_images_do() {
    const SPEED: f64 = 343.0;
    const BIN: f64 = 0.001;
    let time = |duration: f64, absorption: &dyn Fn(usize, f64) -> f64| {
        let mut bins = vec![0.0; (duration / BIN).round() as usize];
        visit_images(0.999_999 * duration * SPEED, absorption, |length, fluence| {
            bins[(length / SPEED / BIN) as usize] += fluence;
        });
        sonel_testkit::decay::reverberation_time(&bins, BIN, -5.0, -35.0)
    };
    for (absorption, duration) in [([0.6; 3], 0.3), ([0.3, 0.1, 0.9], 0.8)] {
        let sides = absorption.map(|absorption| {
            let side = Material::uniform("side", absorption, 0.0, 1);
            Material { law: AbsorptionLaw::LocallyReacting, ..side }
        });
        let impedances =
            absorption.map(|absorption| impedance(absorption).expect("no more than the law allows"));
        let mesh = Mesh::shoebox(SIZE.to_array(), [0, 0, 1, 1, 2, 2]);
        let geometry = Geometry::build(mesh).expect("a box");
        let table = CoefficientTable::new(&sides, 1, 0.15).with_geometry(&geometry);
        let across = |axis: usize| {
            let surface = geometry.surfaces().iter().position(|surface| surface.material == axis as u32);
            SurfaceId(surface.expect("a wall") as u32)
        };
        let surfaces = [0, 1, 2].map(across);
        let of_packets = |axis: usize, cosine: f64| {
            let normal = table.normal(surfaces[axis]);
            let direction =
                cosine * normal + (1.0 - cosine * cosine).max(0.0).sqrt() * normal.any_orthonormal_vector();
            1.0 - table.row(surfaces[axis], direction).specular.energy[0][0]
        };
        let of_ranges = |axis: usize, cosine: f64| {
            let octave = cosine.log2().floor().clamp(-10.0, -1.0).exp2();
            let eighth = ((cosine / octave - 1.0) * 8.0).floor().clamp(0.0, 7.0);
            let range = [octave * (1.0 + eighth / 8.0), octave * (1.0 + (eighth + 1.0) / 8.0)];
            mean_absorption_between(impedances[axis], range)
        };
        let exact = time(duration, &|axis, cosine| absorption_at(impedances[axis], cosine));
        let found = time(duration, &of_packets) / exact - 1.0;
        assert!(found.abs() < 1e-6, "{absorption:?}: {found} of {exact} s");
        let by_ranges = time(duration, &of_ranges) / exact - 1.0;
        assert!(by_ranges < -0.01, "{absorption:?}: {by_ranges}");
    }
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
                // Receiver spheres of finite size are good to a thousandth.
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
#[ignore = "long: cargo xtask accept"]
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
