//! Directivity of sources and receivers in every estimator: tables as the pattern that they were sampled from, exact direct sound,
//! reciprocity, and 1/3 of a diffuse field for a cardioid.

use glam::{DVec3, dvec3};
use sonel_acoustics::{Balloon, BandWidth, Bands, Directivity, Material, Pattern};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::{Estimator, RenderSettings, Rendering};
use sonel_scene::{Receiver, Scene};
use sonel_testkit::z_test::{Variance, z_test};
use sonel_tests::{Traced, fluence, meshes};

/// Rate at which sound statistics would be rejected.
const FALSE_ALARM: f64 = 1e-4;

const ESTIMATORS: [Estimator; 5] =
    [Estimator::Auto, Estimator::Gather, Estimator::Connection, Estimator::Sphere, Estimator::Paper];

fn bands() -> Bands {
    Bands::new(vec![250.0, 500.0], BandWidth::Octave).expect("octaves")
}

/// A box, with a screen in it if asked for. Both bands have the same coefficients: they would be one class.
fn room(is_screened: bool, scattering: f64) -> Scene {
    let mut mesh = Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]);
    if is_screened {
        let corners = [[2.5, 0.8, 0.4], [2.5, 2.6, 0.4], [2.5, 2.6, 1.9], [2.5, 0.8, 1.9]];
        meshes::add_quad(&mut mesh, 0, corners.map(DVec3::from_array));
    }
    Scene::from_parts(mesh, vec![Material::uniform("walls", 0.3, scattering, 2)], bands(), 0.15)
        .without_air_attenuation()
        .with_source("source", [1.2, 1.4, 1.3])
        .with_receiver("receiver", [3.9, 2.3, 1.1])
}

/// The energies of `patterns`, one a band, every 5°.
fn sampled(patterns: [Pattern; 2], aim: DVec3) -> Directivity {
    sampled_every(5, patterns, aim)
}

/// The same every `step` degrees.
fn sampled_every(step: usize, patterns: [Pattern; 2], aim: DVec3) -> Directivity {
    let (azimuths, polars) = (8, 180 / step + 1);
    let energy = |polar: usize| {
        let angle = ((polar * step) as f64).to_radians();
        patterns.map(|pattern| pattern.factor(libm::cos(angle)))
    };
    let energies = (0..azimuths).flat_map(|_| (0..polars).flat_map(energy)).collect();
    let balloon = Balloon::new("sampled", [azimuths, polars, 2], energies).expect("a sound grid");
    Directivity::measured(balloon, aim, dvec3(0.3, 0.9, -0.2)).expect("up across the aim")
}

fn render(mut scene: Scene, directivity: Directivity, aim: DVec3, estimator: Estimator) -> [f64; 2] {
    scene.sources[0].directivity = directivity;
    scene.sources[0].aim = aim;
    if estimator == Estimator::Paper {
        // Its rays are of one class of bands: let there be two in any case.
        scene.materials[0].absorption[1] = 0.31;
    }
    let settings = Settings { emissions: 1_000, batches: 4, ..Settings::default() };
    let traced = if estimator == Estimator::Paper {
        Traced::new(scene, settings)
    } else {
        Traced::diffracting(scene, settings)
    };
    let rendering = traced.render(RenderSettings { rays: Some(256), ..RenderSettings::of(estimator) });
    [0, 1].map(|band| fluence(&rendering, 150, 0, band))
}

/// The same random numbers meet a table and the pattern that it was sampled from, in every estimator: both differ by the error of
/// interpolation, which 5° keep below half a per cent of the level. Each band has the pattern of its own. Edges are selected by all bands together: beside the screen the table
/// is compared with a finer one of both patterns. `Auto` has the estimators of `Gather`, but what it selects of the sonels depends on what they carry.
#[test]
fn a_sampled_pattern_is_the_pattern_in_every_estimator() {
    let aim = dvec3(0.6, 0.48, 0.64);
    for is_screened in [false, true] {
        for estimator in ESTIMATORS.into_iter().filter(|&estimator| estimator != Estimator::Auto) {
            let of = |directivity| render(room(is_screened, 0.3), directivity, aim, estimator);
            let patterns = [Pattern::Cardioid, Pattern::Omni];
            let found = of(sampled(patterns, aim));
            let expected = if is_screened {
                of(sampled_every(1, patterns, aim))
            } else {
                [of(Pattern::Cardioid.into())[0], of(Directivity::OMNI)[1]]
            };
            for band in 0..2 {
                let off = found[band] / expected[band] - 1.0;
                assert!(off.abs() < 5e-3, "{estimator:?} screened {is_screened} band {band}: {off}");
            }
            let off = expected[1] / expected[0] - 1.0;
            assert!(off.abs() > 0.02, "{estimator:?}: another pattern passes: {off}");
        }
    }
}

/// Direct sound alone, on the axis and off it: the factor of the table times 1/(4π r²), to rounding.
#[test]
fn direct_sound_has_the_factor_of_the_table() {
    let aim = dvec3(0.0, 1.0, 0.0);
    let mut scene = room(false, 0.5).with_receiver("ahead", [1.2, 3.4, 1.3]);
    scene.materials[0] = Material::uniform("black", 1.0, 0.5, 2);
    let directivity = sampled([Pattern::Hypercardioid, Pattern::Subcardioid], aim);
    (scene.sources[0].directivity, scene.sources[0].aim) = (directivity.clone(), aim);
    let places: Vec<DVec3> = scene.receivers.iter().map(|receiver| receiver.position).collect();
    let source = scene.sources[0].position;
    let traced = Traced::new(scene, Settings { emissions: 200, ..Settings::default() });
    let rendering = traced.render(RenderSettings::default());
    for (index, place) in places.into_iter().enumerate() {
        let offset = place - source;
        for band in 0..2 {
            let factor = directivity.towards(aim, offset.normalize()).factor(band);
            let expected = factor / (4.0 * std::f64::consts::PI * offset.length_squared());
            let found = fluence(&rendering, 150, index, band);
            assert!((found / expected - 1.0).abs() < 1e-9, "{index} {band}: {found} {expected}");
        }
    }
}

/// A source that was measured off the axes of its file, one that is louder ahead, to the left and above: levels at 1 m around it to 0.01 dB of the
/// law that the file samples, and all of its energy arrives somewhere.
#[test]
fn a_source_in_sofa_has_its_levels_around_it() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/sonel-scene/tests/sofa/turned.sofa");
    let bytes = std::fs::read(file).expect("a file of the corpus");
    let bands = Bands::new(vec![500.0, 1000.0], BandWidth::Octave).expect("octaves");
    let (balloon, _) = sonel_scene::load_balloon(file, &bytes, &bands).expect("a directivity");
    let (ahead, up) = (dvec3(0.6, 0.0, -0.8), dvec3(0.8, 0.0, 0.6));
    let left = up.cross(ahead);
    let middle = dvec3(2.5, 2.0, 1.5);
    let root = 0.75_f64.sqrt();
    let sides = [ahead, -ahead, left, -left, up, -up, root * left + 0.5 * ahead, 0.5 * up - root * left];
    let mesh = Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]);
    let walls = vec![Material::uniform("black", 1.0, 0.5, 2)];
    let mut scene = Scene::from_parts(mesh, walls, bands, 0.15).without_air_attenuation();
    scene = scene.with_source("source", middle.to_array());
    for side in sides {
        scene = scene.with_receiver(&side.to_string(), (middle + side).to_array());
    }
    scene.sources[0].directivity = Directivity::measured(balloon, ahead, up).expect("up across the aim");
    scene.sources[0].aim = ahead;
    let traced = Traced::new(scene, Settings { emissions: 20_000, ..Settings::default() });
    for band in &traced.ledger.bands {
        assert!((band.emitted - 1.0).abs() < 1e-12 && (band.absorbed - 1.0).abs() < 0.005, "{band:?}");
    }
    let rendering = traced.render(RenderSettings::default());
    for (index, side) in sides.into_iter().enumerate() {
        for (band, strength) in [1.0, -0.5].into_iter().enumerate() {
            let law = 1.0 + strength * (0.4 * side.dot(ahead) + 0.25 * side.dot(left) + 0.15 * side.dot(up));
            let found = fluence(&rendering, 150, index, band) * 4.0 * std::f64::consts::PI;
            let off = 10.0 * libm::log10(found / law);
            assert!(off.abs() < 0.01, "{side} band {band}: {off} dB");
        }
    }
}

/// Every source of a map, each in its own way, sends out one unit of energy per band.
#[test]
fn the_ledgers_of_a_measured_source_close() {
    let aim = dvec3(0.6, 0.48, 0.64);
    let mut scene = room(true, 0.3);
    (scene.sources[0].directivity, scene.sources[0].aim) =
        (sampled([Pattern::Cardioid, Pattern::Hypercardioid], aim), aim);
    let traced = Traced::new(scene, Settings { emissions: 20_000, ..Settings::default() });
    for band in &traced.ledger.bands {
        assert!((band.emitted - 1.0).abs() < 1e-12 && band.relative_residual() < 1e-9);
        // Directions are stratified: the factor's mean over them is nearly that over the sphere.
        assert!((band.absorbed + band.truncated - 1.0).abs() < 0.02, "{band:?}");
    }
}

/// Six receivers at one place, each of a pattern that looks along an axis of `scene`, and an omnidirectional one.
fn six_ways(mut scene: Scene, pattern: Pattern) -> Scene {
    let position = scene.receivers[0].position;
    let aims = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    scene.receivers.extend(aims.into_iter().map(|aim| Receiver {
        name: aim.to_string(),
        position,
        aim,
        pattern,
    }));
    scene
}

fn traced(scene: Scene, emissions: u64, estimator: Estimator) -> Rendering {
    let settings = Settings { emissions, ..Settings::default() };
    Traced::new(scene, settings).render(RenderSettings { rays: Some(1_024), ..RenderSettings::of(estimator) })
}

/// Whatever the field, cardioids along six axes take 1/3 on average: Σ (1 + cos)²/4 over them is 2. So no energy comes from nowhere.
#[test]
fn cardioids_along_six_axes_take_a_third_of_any_field() {
    for is_screened in [false, true] {
        for estimator in ESTIMATORS {
            let rendering = traced(six_ways(room(is_screened, 0.5), Pattern::Cardioid), 1_000, estimator);
            let all = fluence(&rendering, 150, 0, 0);
            let mean = (1..=6).map(|receiver| fluence(&rendering, 150, receiver, 0)).sum::<f64>() / 6.0;
            // Visibility rays of a cardioid end by roulette of their own.
            let tolerance = if estimator == Estimator::Connection { 1e-6 } else { 0.02 };
            assert!(
                (3.0 * mean / all - 1.0).abs() < tolerance,
                "{estimator:?} {is_screened}: {}",
                mean / all
            );
            // Towards the source is more than away from it: signs are right.
            let (ahead, behind) = (fluence(&rendering, 150, 2, 0), fluence(&rendering, 150, 1, 0));
            assert!(ahead > 1.2 * behind, "{estimator:?} {is_screened}: {ahead} {behind}");
        }
    }
}

/// By batch, what `pattern` along x takes of what arrives after 60 ms in the middle of a cube that scatters all.
fn late_shares(pattern: Pattern) -> Vec<f64> {
    let mesh = Mesh::shoebox([4.0; 3], [0; 6]);
    let walls = vec![Material::uniform("walls", 0.1, 1.0, 2)];
    let scene = Scene::from_parts(mesh, walls, bands(), 0.15)
        .without_air_attenuation()
        .with_source("source", [0.7, 1.1, 0.9])
        .with_receiver("middle", [2.0; 3]);
    let mut scene = six_ways(scene, pattern);
    scene.receivers.truncate(2);
    let rendering = traced(scene, 10_000, Estimator::Auto);
    let late = |receiver: &sonel_renderer::CoarseEchogram| receiver.band(0).skip(60).sum::<f64>();
    rendering.batches.iter().map(|batch| late(&batch[1]) / late(&batch[0])).collect()
}

/// Late sound in a cube of diffuse walls comes to its middle from all directions alike, to second order in their cosines.
#[test]
fn a_cardioid_takes_a_third_of_a_diffuse_field() {
    let p = z_test(&late_shares(Pattern::Cardioid), 1.0 / 3.0, Variance::Estimated);
    assert!(p > FALSE_ALARM, "{p}");
}

#[test]
fn a_hypercardioid_does_not() {
    let shares = late_shares(Pattern::Hypercardioid);
    let [third, quarter] = [3.0, 4.0].map(|part| z_test(&shares, 1.0 / part, Variance::Estimated));
    assert!(third < FALSE_ALARM && quarter > FALSE_ALARM, "{third} {quarter}");
}

/// A cardioid that sends to an omnidirectional receiver is an omnidirectional source that sends to a cardioid, but for its norm, 3.
/// Image sources and edges are exact both ways.
#[test]
fn source_and_receiver_may_change_places() {
    let aim = dvec3(0.6, -0.48, 0.64);
    for is_screened in [false, true] {
        let mirrors = |scene: Scene| {
            let settings = Settings { emissions: 100, batches: 4, ..Settings::default() };
            let traced = Traced::diffracting(scene, settings);
            let settings = RenderSettings { mirror_order: Some(3), ..RenderSettings::default() };
            let rendering = traced.render(settings);
            rendering.classes[..3].iter().map(|(_, energy)| energy[0]).sum::<f64>()
        };
        let mut sending = room(is_screened, 0.0);
        (sending.sources[0].directivity, sending.sources[0].aim) = (Pattern::Cardioid.into(), aim);
        let mut receiving = sonel_tests::change::exchanged(room(is_screened, 0.0), 0);
        (receiving.receivers[0].pattern, receiving.receivers[0].aim) = (Pattern::Cardioid, aim);
        let (sent, received) = (mirrors(sending), mirrors(receiving));
        let off = sent / (3.0 * received) - 1.0;
        assert!(off.abs() < if is_screened { 0.03 } else { 1e-6 }, "{is_screened}: {off}");
        let omni = mirrors(room(is_screened, 0.0));
        assert!((sent / omni - 1.0).abs() > 0.1, "the pattern matters");
    }
}

/// Direct sound of the shipped loudspeaker on its axis: directivity index of the table by a quadrature apart from this code, in its README.
#[test]
fn the_shipped_loudspeaker_has_its_directivity_index() {
    let scene = sonel_tests::shipped("loudspeaker").without_air_attenuation();
    let traced = Traced::new(scene, Settings { emissions: 100, batches: 2, ..Settings::default() });
    let settings = RenderSettings { mirror_order: Some(0), rays: Some(2), ..RenderSettings::default() };
    let rendering = traced.render(settings);
    let direct = |receiver: usize| {
        let found = rendering.arrivals.iter().find(|arrival| arrival.receiver == receiver);
        found.expect("direct sound").energy.clone()
    };
    let indices = [0.12, 0.46, 1.43, 3.19, 5.55, 8.59, 5.98, 7.02];
    for (energy, index) in direct(0).iter().zip(indices) {
        let spread = 1.0 / (4.0 * std::f64::consts::PI * 9.0);
        let found = 10.0 * libm::log10(energy / spread);
        assert!((found - index).abs() < 0.01, "{found} dB instead of {index} dB");
    }
    // 45.94° to the right: energies of the rows 0,45 and 0,50, linear between them.
    let aside = direct(1);
    for (band, level) in [0.00, -0.12, -0.42, -1.05, -1.97, -2.89, -2.47, -3.52].into_iter().enumerate() {
        let distances = (1.5 * 1.5 + 1.55 * 1.55) / 9.0;
        let found = 10.0 * libm::log10(aside[band] / direct(0)[band] * distances);
        assert!((found - level).abs() < 0.01, "{band}: {found} dB instead of {level} dB");
    }
}
