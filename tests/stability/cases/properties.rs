//! Laws that hold in every room, in rooms drawn at random.

use glam::DVec3;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_analysis::{Parameter, parameters};
use sonel_geometry::Mesh;
use sonel_map::{Fate, Settings};
use sonel_renderer::{CoarseEchogram, Estimator, PathClass, RenderSettings};
use sonel_scene::Scene;
use sonel_testkit::z_test::{Estimate, Within, agree};
use sonel_tests::change::{exchanged, moved};
use sonel_tests::estimates::{Windows, windows};
use sonel_tests::{Traced, meshes};

use super::form;

/// A box with walls of their own, a screen or none, a source and a receiver.
#[derive(Debug, Clone)]
struct Room {
    size: [f64; 3],
    absorption: [[f64; 6]; 2],
    scattering: [[f64; 6]; 2],
    /// Where along each axis, as a part of the size.
    source: [f64; 3],
    receiver: [f64; 3],
    screen: bool,
}

fn rooms() -> impl Strategy<Value = Room> {
    let size = [2.0..30.0, 2.0..20.0, 2.0..10.0];
    let share = || [0.05..0.45, 0.05..0.95, 0.05..0.95];
    let absorption = proptest::array::uniform2(proptest::array::uniform6(0.03..0.95_f64));
    let scattering =
        proptest::array::uniform2(proptest::array::uniform6(prop_oneof![Just(0.0), 0.0..1.0, Just(1.0)]));
    (size, absorption, scattering, share(), share(), any::<bool>()).prop_map(
        |(size, absorption, scattering, source, [x, y, z], screen)| Room {
            size,
            absorption,
            scattering,
            source,
            // On the other side of the middle.
            receiver: [x + 0.5, y, z],
            screen,
        },
    )
}

impl Room {
    fn mesh(&self) -> Mesh {
        let mut mesh = Mesh::shoebox(self.size, [0, 1, 2, 3, 4, 5]);
        if self.screen {
            let at = |y: f64, z: f64| DVec3::from(self.size) * DVec3::new(0.48, y, z);
            meshes::add_quad(&mut mesh, 2, [at(0.3, 0.0), at(0.8, 0.0), at(0.8, 0.7), at(0.3, 0.7)]);
        }
        mesh
    }

    /// Lasts until 25 free paths have been gone.
    fn scene(&self) -> Scene {
        let [x, y, z] = self.size;
        let free_path = 2.0 * x * y * z / (x * y + y * z + z * x);
        let bands = Bands::new(vec![500.0, 1000.0], BandWidth::Octave).expect("two octaves");
        let wall = |wall: usize| Material {
            absorption: self.absorption.iter().map(|walls| walls[wall]).collect(),
            scattering: self.scattering.iter().map(|walls| walls[wall]).collect(),
            ..Material::uniform("wall", 0.0, 0.0, 2)
        };
        let place = |share: [f64; 3]| (DVec3::from(share) * DVec3::from(self.size)).to_array();
        let mut scene = Scene::from_parts(self.mesh(), (0..6).map(wall).collect(), bands, 0.0)
            .with_source("source", place(self.source))
            .with_receiver("receiver", place(self.receiver))
            .without_air_attenuation();
        scene.speed_of_sound = 343.0;
        // A whole number of milliseconds.
        scene.with_duration((25.0 * free_path / 343.0 * 1000.0).ceil() / 1000.0)
    }
}

fn settings(seed: u64) -> Settings {
    Settings { emissions: form(3_000, 30_000), seed, ..Settings::default() }
}

fn borders(duration: f64) -> [f64; 4] {
    [0.0, 0.1, 0.3, 1.0].map(|share| (share * duration * 1000.0).round() / 1000.0)
}

/// Energies of both bands between [`borders`].
fn received(scene: Scene, settings: Settings, estimator: Estimator) -> Vec<Windows> {
    heard_with(&[], scene, settings, estimator)
}

/// The same with `effects`.
fn heard_with(effects: &[&str], scene: Scene, settings: Settings, estimator: Estimator) -> Vec<Windows> {
    let borders = borders(scene.duration);
    let traced = Traced::with(effects, scene, settings);
    let settings = RenderSettings { estimator, rays: Some(4_096), ..RenderSettings::default() };
    windows(&traced, settings, &borders).swap_remove(0)
}

/// Runs `law` in random rooms, the same ones each time.
fn in_rooms(seed: u64, law: impl Fn(Room) -> Result<(), String>) {
    let config = Config {
        cases: form(3, 60),
        rng_seed: RngSeed::Fixed(seed),
        failure_persistence: None,
        max_shrink_iters: 0,
        ..Config::default()
    };
    let checked = TestRunner::new(config).run(&rooms(), |room| law(room).map_err(TestCaseError::fail));
    checked.unwrap_or_else(|error| panic!("{error}"));
}

/// Whether all windows agree within six joint standard errors: of the hundreds of windows of a law, few batches of which
/// are normal, none is beyond by chance. A window whose error exceeds a third of its energy says nothing and is left out.
fn agreement(first: &[Windows], second: &[Windows]) -> Result<usize, String> {
    let mut compared = 0;
    for (band, (first, second)) in first.iter().zip(second).enumerate() {
        let all: f64 = second.iter().map(|window| window.value).sum();
        for (window, (&first, &second)) in first.iter().zip(second).enumerate() {
            // Where images own everything there is no spread: a millionth stands for their rounding.
            let known = |estimate: Estimate| Estimate {
                sigma: estimate.sigma.max(1e-6 * estimate.value.abs()).max(1e-9 * all),
                ..estimate
            };
            let (first, second) = (known(first), known(second));
            let within = Within { sigmas: 6.0, maximal_sigma: 0.33 * first.value.max(second.value) };
            if first.sigma.hypot(second.sigma) > within.maximal_sigma {
                continue;
            }
            agree(first, second, within).map_err(|error| format!("band {band}, window {window}: {error}"))?;
            compared += 1;
        }
    }
    Ok(compared)
}

fn must_agree(first: &[Windows], second: &[Windows]) -> Result<(), String> {
    let compared = agreement(first, second)?;
    if compared < 3 { Err(format!("only {compared} windows say anything")) } else { Ok(()) }
}

#[test]
fn source_and_receiver_may_be_exchanged_in_any_room() {
    in_rooms(1, |room| {
        let there = received(room.scene(), settings(1), Estimator::Auto);
        must_agree(&there, &received(exchanged(room.scene(), 0), settings(2), Estimator::Auto))
    });
}

#[test]
fn any_room_may_stand_anywhere() {
    in_rooms(2, |room| {
        let here = received(room.scene(), settings(1), Estimator::Auto);
        must_agree(&here, &received(moved(room.scene()), settings(2), Estimator::Auto))
    });
}

#[test]
fn faces_of_any_room_may_be_divided() {
    in_rooms(3, |room| {
        let whole = received(room.scene(), settings(1), Estimator::Auto);
        let mut scene = room.scene();
        scene.mesh = meshes::tessellated(&scene.mesh, 2);
        must_agree(&whole, &received(scene, settings(2), Estimator::Auto))
    });
}

/// Energies as spheres find them. Where a window is met by fewer than half of the batches their spread is no measure of
/// what they missed, and what one packet brings that crosses the sphere stands for it.
fn heard_by_spheres(scene: Scene, settings: Settings) -> Vec<Windows> {
    let borders = borders(scene.duration);
    let traced = Traced::new(scene, settings);
    let rendered = RenderSettings { estimator: Estimator::Connection, ..RenderSettings::default() };
    let mut received = windows(&traced, rendered.clone(), &borders).swap_remove(0);
    let (rendering, _) = traced.render_with(rendered, &[borders.to_vec()]);
    let disc = std::f64::consts::PI * rendering.sphere_radius[0].powi(2);
    let crossing = 1.0 / (settings.emissions as f64 * disc);
    for (band, windows) in received.iter_mut().enumerate() {
        for (window, estimate) in windows.iter_mut().enumerate() {
            let met =
                |batch: &&Vec<CoarseEchogram>| batch[0].band(band).nth(window).is_some_and(|d| d.abs() > 0.0);
            let batches = rendering.kernel_differences.iter().filter(met).count();
            if 2 * batches < rendering.batches.len() {
                estimate.sigma = estimate.sigma.max(crossing);
            }
        }
    }
    received
}

/// By two different ways: images of the receiver or visibility rays where they are best, and spheres alone.
#[test]
fn estimators_agree_in_any_room() {
    in_rooms(4, |room| {
        let auto = received(room.scene(), settings(1), Estimator::Auto);
        // Spheres are cheap, and noisy.
        let many = Settings { emissions: 10 * settings(2).emissions, ..settings(2) };
        must_agree(&auto, &heard_by_spheres(room.scene(), many))
    });
}

/// The sibling of all of these: another room is told from this one.
#[test]
fn a_room_that_absorbs_more_is_told_apart() {
    in_rooms(5, |room| {
        let here = received(room.scene(), settings(1), Estimator::Auto);
        let mut more = room;
        more.absorption.iter_mut().flatten().for_each(|absorption| *absorption += 0.5 * (1.0 - *absorption));
        match agreement(&here, &received(more.scene(), settings(2), Estimator::Auto)) {
            Ok(compared) => {
                Err(format!("half of all reflections are missing and none of {compared} windows shows it"))
            }
            Err(_) => Ok(()),
        }
    });
}

/// Lengths twice as large: times are, and levels fall by 20 lg 2, to the last bits.
#[test]
#[ignore = "long: cargo xtask accept"]
fn lengths_scale_in_any_room() {
    in_rooms(6, |room| {
        let small = received(room.scene(), settings(1), Estimator::Connection);
        let mut double = room.scene();
        double.mesh.vertices.iter_mut().for_each(|vertex| *vertex *= 2.0);
        double.sources[0].position *= 2.0;
        double.receivers[0].position *= 2.0;
        double.duration *= 2.0;
        let borders = borders(room.scene().duration).map(|border| 2.0 * border);
        let traced = Traced::new(double, settings(1));
        let settings =
            RenderSettings { bin: 0.002, estimator: Estimator::Connection, ..RenderSettings::default() };
        let large = windows(&traced, settings, &borders).swap_remove(0);
        for (small, large) in small.iter().flatten().zip(large.iter().flatten()) {
            if (4.0 * large.value - small.value).abs() > 1e-9 * small.value {
                return Err(format!("{small:?} and {large:?}"));
            }
        }
        Ok(())
    });
}

/// More absorption, less energy: without roulette the paths stay, and every bin falls.
#[test]
fn energy_falls_with_absorption_in_any_room() {
    in_rooms(7, |room| {
        let bins = |room: &Room| {
            let scene = room.scene();
            let count = (scene.duration * 1000.0).round() as usize;
            let settings = Settings { survival: 0.0, ..settings(1) };
            let shared = Settings { spectral: sonel_map::Spectral::PerBand, ..settings };
            let traced = Traced::new(scene, shared);
            let settings = RenderSettings { estimator: Estimator::Connection, ..RenderSettings::default() };
            let rendering = traced.render(settings);
            (0..2 * count).map(|at| rendering.total.get(0, at / 2, at % 2)).collect::<Vec<f64>>()
        };
        let mut more = room.clone();
        more.absorption.iter_mut().flatten().for_each(|absorption| *absorption += 0.02);
        let (less, more) = (bins(&room), bins(&more));
        let risen = less.iter().zip(&more).filter(|(less, more)| **more > **less * (1.0 + 1e-9)).count();
        let fallen = less.iter().zip(&more).filter(|(less, more)| **more < **less * (1.0 - 1e-9)).count();
        if risen > 0 || fallen < 10 { Err(format!("{risen} bins rise, {fallen} fall")) } else { Ok(()) }
    });
}

/// The ledger closed, nobody lost, every number a number: energies, and parameters or their reasons. Edges diffract where there are any.
#[test]
fn ledgers_close_and_outputs_are_finite_in_any_room() {
    in_rooms(8, |room| {
        let traced = Traced::diffracting(room.scene(), settings(1));
        let residual = traced.ledger.worst_residual();
        if residual > 1e-9 || traced.ledger.fates.count(Fate::Lost) > 0 {
            return Err(format!("residual {residual:e}, {:?}", traced.ledger.fates));
        }
        let strange = traced
            .ledger
            .bands
            .iter()
            .find(|ledger| ledger.sampling.abs() > 5.0 * ledger.sampling_sigma() + 1e-12);
        if let Some(ledger) = strange {
            return Err(format!("{ledger:?}"));
        }
        let response = traced.respond(RenderSettings::default());
        if !response.energy.iter().all(|energy| energy.is_finite() && *energy >= 0.0) {
            return Err("an energy is none".to_owned());
        }
        for band in &parameters(&response)[0].bands {
            for parameter in Parameter::ALL {
                let Ok(estimate) = band.parameter(parameter) else { continue };
                let interval =
                    estimate.interval.as_ref().is_ok_and(|ends| !ends.iter().all(|end| end.is_finite()));
                if !estimate.value.is_finite() || interval {
                    return Err(format!("{parameter:?}: {estimate:?}"));
                }
            }
        }
        Ok(())
    });
}

/// Edges that diffract.
const EDGES: [&str; 1] = ["diffraction"];

fn screened(room: Room) -> Room {
    Room { screen: true, ..room }
}

/// What is diffracted may go either way, in rooms with everything else that may.
#[test]
#[ignore = "long: cargo xtask accept"]
fn diffracted_sound_may_go_either_way_in_any_room() {
    in_rooms(9, |room| {
        let scene = screened(room).scene();
        // Behind a screen less arrives: so many more packets that most windows say something.
        let settings = |seed| Settings { emissions: 4 * settings(seed).emissions, ..settings(seed) };
        let there = heard_with(&EDGES, scene.clone(), settings(1), Estimator::Auto);
        must_agree(&there, &heard_with(&EDGES, exchanged(scene, 0), settings(2), Estimator::Auto))
    });
}

/// The deterministic part of a screened room and of the box alone: energies of direct sound, image-source paths and edges in both
/// bands.
fn deterministic(effects: &[&str], scene: Scene) -> [f64; 2] {
    let traced = Traced::with(effects, scene, Settings { emissions: 64, ..settings(1) });
    let rendering = traced.render(RenderSettings { mirror_order: Some(2), ..RenderSettings::default() });
    let classes = [PathClass::Direct, PathClass::ImageSource, PathClass::Edge];
    [0, 1].map(|band| classes.iter().map(|&class| rendering.classes[class as usize].1[band]).sum())
}

/// Edges redistribute: what is heard over a screen is at most the sum of all free fields, of the source and its images in walls
/// that reflect everything, times the square of a wave and half a one for each of its three free edges.
#[test]
fn edges_add_no_energy_to_the_free_fields_of_any_room() {
    const LIMIT: f64 = 2.5 * 2.5;
    let largest = std::cell::Cell::new(0.0_f64);
    in_rooms(10, |room| {
        let found = deterministic(&EDGES, screened(room.clone()).scene());
        let mut rigid = Room { screen: false, ..room };
        rigid.absorption = [[0.0; 6]; 2];
        rigid.scattering = [[0.0; 6]; 2];
        // The screen's own images lie in the room, where the box has none: at most as many again for each of its sides.
        let free = deterministic(&[], rigid.scene()).map(|free| 3.0 * free);
        let part = found.iter().zip(free).map(|(found, free)| found / free).fold(0.0, f64::max);
        largest.set(largest.get().max(part));
        if found.iter().all(|energy| energy.is_finite()) && part < LIMIT {
            Ok(())
        } else {
            Err(format!("{part}"))
        }
    });
    println!("over screens at most {:.2} of the free fields", largest.get());
    assert!(100.0 * largest.get() > LIMIT, "edges louder by 20 dB are noticed");
}

/// Diffracted sound: the ledger closed, nobody lost, the same bits on one thread and on three, and again.
#[test]
fn edges_keep_ledgers_and_bits_in_any_room() {
    in_rooms(11, |room| {
        let scene = screened(room).scene();
        let run = |threads: usize, seed: u64| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| {
                let few = Settings { emissions: form(600, 6_000), ..settings(seed) };
                let traced = Traced::with(&EDGES, scene.clone(), few);
                let response =
                    traced.respond(RenderSettings { rays: Some(512), ..RenderSettings::default() });
                let bits: Vec<u64> = response.energy.iter().map(|energy| energy.to_bits()).collect();
                (traced.map.digest(), bits, response, traced.ledger)
            })
        };
        let (digest, bits, response, ledger) = run(1, 1);
        if ledger.worst_residual() > 1e-9 || ledger.fates.count(Fate::Lost) > 0 {
            return Err(format!("residual {:e}, {:?}", ledger.worst_residual(), ledger.fates));
        }
        if !response.energy.iter().all(|energy| energy.is_finite() && *energy >= 0.0) {
            return Err("an energy is none".to_owned());
        }
        let (again, bits_again, ..) = run(3, 1);
        if again != digest || bits_again != bits {
            return Err("other bits on three threads".to_owned());
        }
        if run(1, 2).1 == bits { Err("another seed makes no difference".to_owned()) } else { Ok(()) }
    });
}
