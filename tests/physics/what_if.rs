//! Other materials on the same map against fresh traces of them, and changes that the paths cannot carry.

use sonel::study::response::receivers_of;
use sonel_acoustics::{BandWidth, Bands, Coefficient, Material, Pattern};
use sonel_analysis::what_if::{Fitness, fitness};
use sonel_analysis::{Parameter, ReceiverParameters, parameters};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_map::leads::{MOST_SETS, set_count};
use sonel_renderer::{RenderSettings, Renderer};
use sonel_scene::{Design, Scene};
use sonel_tests::estimates::{agree_in_windows, windows};
use sonel_tests::two_rooms::{Partition, two_rooms};
use sonel_tests::{Traced, batch_fluence, changed_box};

const BORDERS: [f64; 5] = [0.0, 0.03, 0.1, 0.2, 0.4];

fn material(name: &str, absorption: [f64; 2], scattering: [f64; 2]) -> Material {
    Material {
        absorption: absorption.to_vec(),
        scattering: scattering.to_vec(),
        ..Material::uniform(name, 0.0, 0.0, 2)
    }
}

/// A box of three materials.
fn room() -> Scene {
    let materials = vec![
        material("walls", [0.2, 0.1], [0.3, 0.5]),
        material("floor", [0.1, 0.3], [0.1, 0.2]),
        material("ceiling", [0.3, 0.4], [0.6, 0.6]),
    ];
    let bands = Bands::new(vec![500.0, 1000.0], BandWidth::Octave).expect("octaves");
    Scene::from_parts(Mesh::shoebox([6.0, 5.0, 4.0], [0, 0, 0, 0, 1, 2]), materials, bands, 0.4)
        .with_source("source", [1.5, 1.2, 1.3])
        .with_receiver("receiver", [4.2, 3.7, 2.1])
        .without_air_attenuation()
}

fn trace(scene: &Scene, seed: u64) -> Traced {
    Traced::new(scene.clone(), Settings { emissions: 30_000, seed, ..Settings::default() })
}

/// A map of `scene` given the materials and sources of `other`.
fn as_if(scene: &Scene, other: &Scene) -> (Traced, Fitness) {
    let mut traced = trace(scene, 1);
    traced.map.change(other.materials.clone(), other.sources.clone());
    let fitness = fitness(&traced.map, &traced.geometry, traced.map.layout().batches);
    (traced, fitness)
}

/// Enough for a room in which little energy needs rays.
fn few_rays() -> RenderSettings {
    RenderSettings { rays: Some(16_384), ..RenderSettings::default() }
}

fn windows_of(traced: &Traced) -> Vec<Vec<Vec<sonel_testkit::z_test::Estimate>>> {
    windows(traced, few_rays(), &BORDERS)
}

fn check(scene: &Scene, change: impl Fn(&mut Scene)) {
    let mut other = scene.clone();
    change(&mut other);
    let (changed, fitness) = as_if(scene, &other);
    assert!(fitness.refusals.is_empty(), "{:?}", fitness.refusals);
    let [found, fresh, before] =
        [changed, trace(&other, 2), trace(scene, 3)].map(|traced| windows_of(&traced));
    let mut tells = false;
    for receiver in 0..found.len() {
        for band in 0..found[receiver].len() {
            let [found, fresh, before] = [&found, &fresh, &before].map(|windows| &windows[receiver][band]);
            agree_in_windows(found, fresh, 0.1)
                .unwrap_or_else(|flaw| panic!("receiver {receiver}, band {band}: {flaw}"));
            tells |= agree_in_windows(before, fresh, 0.1).is_err();
        }
    }
    assert!(tells, "the change is too small to be seen");
}

#[test]
fn absorption() {
    check(&room(), |scene| {
        scene.materials[0].absorption = vec![0.1, 0.3];
        scene.materials[2].absorption = vec![0.5, 0.2];
    });
}

#[test]
fn scattering() {
    let mut flutter = room();
    flutter.materials[1].absorption = vec![0.8; 2];
    flutter.materials[2].absorption = vec![0.8; 2];
    check(&flutter, |scene| scene.materials[0].scattering = vec![0.08, 0.1]);
}

/// Three materials with two scattering coefficients each would be eight combinations; named, they are two.
#[test]
fn scattering_of_a_named_variant() {
    let mut flutter = room();
    flutter.materials[1].absorption = vec![0.8; 2];
    flutter.materials[2].absorption = vec![0.8; 2];
    let smooth = |of: &Material| vec![Material { scattering: vec![0.08, 0.1], ..of.clone() }];
    flutter.variants = flutter.materials.iter().map(smooth).collect();
    assert_eq!(set_count(&flutter), MOST_SETS + 1, "and more");
    flutter.designs = vec![Design { name: "smooth".to_owned(), choices: vec![(0, 0), (1, 0), (2, 0)] }];
    assert_eq!(set_count(&flutter), 2);
    check(&flutter, |scene| scene.materials = scene.design("smooth").expect("the design"));
}

#[test]
fn everything_at_once() {
    check(&room(), |scene| {
        scene.materials[0].absorption = vec![0.3, 0.2];
        scene.materials[0].scattering = vec![0.4, 0.4];
        scene.materials[2].absorption = vec![0.2, 0.3];
        scene.sources[0].directivity = Pattern::Cardioid.into();
    });
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn transmission() {
    let scene = two_rooms(Partition::Sheet, [0.2, 0.3], 0.5, &[1e-2, 1e-3]).with_duration(0.4);
    check(&scene, |scene| scene.materials[2].transmission = vec![3e-3, 2e-2]);
}

/// Level over that of a fresh trace [dB] of the second band, if the change were not refused.
fn silently_wrong_by(scene: &Scene, change: impl Fn(&mut Scene), expected: &str) -> f64 {
    let mut other = scene.clone();
    change(&mut other);
    let (changed, fitness) = as_if(scene, &other);
    assert!(fitness.refusals.iter().any(|sentence| sentence.contains(expected)), "{fitness:?}");
    let [found, fresh] =
        [changed, trace(&other, 2)].map(|traced| batch_fluence(&traced.render(few_rays()), 0, 1).0);
    10.0 * (found / fresh).log10()
}

/// Mirrors that are to scatter: no packet ever did, so what would be scattered is missing.
#[test]
fn events_that_were_never_drawn_are_refused() {
    let mut scene = room();
    scene.materials.iter_mut().for_each(|material| material.scattering = vec![0.0; 2]);
    let scatter = |scene: &mut Scene| scene.materials[0].scattering = vec![0.7; 2];
    let wrong = silently_wrong_by(
        &scene,
        scatter,
        "materials.walls at 500, 1000 Hz: no packet of this map was scattered",
    );
    assert!(wrong < -1.0, "{wrong} dB");
}

/// Paths were broken off where they carried nothing, and the run is as short as its absorption allowed.
#[test]
#[ignore = "long: cargo xtask accept"]
fn paths_that_end_too_early_are_refused() {
    let mut scene = room();
    scene.materials.iter_mut().for_each(|material| material.absorption = vec![0.4; 2]);
    let liven = |scene: &mut Scene| {
        scene.materials.iter_mut().for_each(|material| material.absorption = vec![0.05; 2]);
        scene.duration = 2.0;
    };
    let wrong = silently_wrong_by(&scene, liven, "of the energy left");
    assert!(wrong < -0.3, "{wrong} dB");
}

/// From nearly black to live: few packets were reflected often enough.
#[test]
fn ledgers_that_do_not_close_are_refused() {
    let mut scene = room().with_duration(1.5);
    scene.materials.iter_mut().for_each(|material| material.absorption = vec![0.97; 2]);
    let liven = |scene: &mut Scene| {
        scene.materials.iter_mut().for_each(|material| material.absorption = vec![0.1; 2]);
    };
    let wrong = silently_wrong_by(&scene, liven, "the energy balance with the changed materials errs by");
    assert!(wrong.abs() > 0.3, "{wrong} dB");
}

/// From mirrors to Lambert's law: few packets were scattered twice.
#[test]
fn energy_on_few_packets_is_refused() {
    let mut scene = room();
    scene.materials.iter_mut().for_each(|material| material.scattering = vec![0.08; 2]);
    let scatter = |scene: &mut Scene| {
        scene.materials.iter_mut().for_each(|material| material.scattering = vec![0.9; 2]);
    };
    let wrong = silently_wrong_by(&scene, scatter, "few packets carry the energy");
    assert!(wrong.abs() > 0.3, "{wrong} dB");
}

/// Whether value and 95 % interval of each parameter agree with what the slow simulator counts for other walls, within four standard errors.
fn agree_with_count(traced: &Traced, walls: &changed_box::Walls) -> Result<(), String> {
    // Rays end at a black floor, and few packets avoid it for long.
    let (rays, sharpness) = if walls[4][0] < 1.0 { (1500, 0.02) } else { (15_000, 0.04) };
    let counted = changed_box::counted(walls, rays);
    for ((parameter, found), counted) in changed_box::READ.iter().zip(changed_box::read(traced)).zip(counted)
    {
        let (value, [low, high]) = found.ok_or(format!("{parameter:?}: no interval"))?;
        let sigma = ((high - low) / 3.92).hypot(counted.sigma);
        if (value - counted.value).abs() > 4.0 * sigma || sigma > sharpness * counted.value {
            return Err(format!("{parameter:?}: {value} ({low} … {high}), counted {counted:?}"));
        }
    }
    Ok(())
}

const FEW: Settings = Settings {
    emissions: 20_000,
    seed: 1,
    batches: 32,
    survival: 0.15,
    spectral: sonel_map::Spectral::Shared,
    mode: sonel_map::Mode::Accurate,
};

/// A floor that absorbs a little more than that is noticed.
#[test]
#[ignore = "long: cargo xtask accept"]
fn reverberation_with_another_floor_is_that_of_the_slow_simulator() {
    let [dead, live] = [0.7, 0.1].map(|absorption| changed_box::with_floor([absorption, 0.3]));
    let scene = changed_box::scene(&dead, &[]);
    let (traced, fitness) = changed_box::changed(&scene, &live, FEW);
    assert!(fitness.refusals.is_empty(), "{fitness:?}");
    agree_with_count(&traced, &live).unwrap();
    assert!(agree_with_count(&traced, &changed_box::with_floor([0.15, 0.3])).is_err());
}

/// Intervals that the batches of a map cannot tell: most maps have none of the packets that carry the energy.
#[test]
fn other_scattering_of_all_walls_is_refused() {
    for [drawn, changed] in [[0.3, 0.02], [0.1, 0.3]] {
        let walls = |scattering| [[0.1, scattering]; 6];
        let (_, fitness) =
            changed_box::changed(&changed_box::scene(&walls(drawn), &[]), &walls(changed), FEW);
        assert!(fitness.refusals.iter().any(|refusal| refusal.contains("few packets")), "{fitness:?}");
    }
}

/// Walls that no packet of a map without variants can have met so: black to live, mirror to scattering.
#[test]
#[ignore = "long: cargo xtask accept"]
fn a_map_carries_its_variants_as_traces_of_their_own() {
    let walls = changed_box::with_floor([1.0, 0.0]);
    let others = [[0.1, 0.0], [0.1, 0.6], [1.0, 0.6]].map(changed_box::with_floor);
    let scene = changed_box::scene(&walls, &others);
    for other in [others[1], walls] {
        let (traced, fitness) = changed_box::changed(&scene, &other, FEW);
        assert_eq!(fitness, Fitness::default());
        agree_with_count(&traced, &other).unwrap();
        let fresh = changed_box::read(&Traced::new(changed_box::scene(&other, &[]), FEW));
        // Each interval is uncertain by an eighth: their mean is compared.
        let widths =
            |read: [Option<(f64, [f64; 2])>; 3]| read.map(|read| read.map(|(_, [low, high])| high - low));
        let pairs = widths(changed_box::read(&traced)).into_iter().zip(widths(fresh));
        let ratios: Option<Vec<f64>> = pairs.map(|(found, fresh)| Some(found? / fresh?)).collect();
        let ratio = ratios.expect("intervals").iter().sum::<f64>() / 3.0;
        assert!(ratio < 2.0, "{ratio} times as wide");
    }
    let alone = changed_box::changed(&changed_box::scene(&walls, &[]), &others[1], FEW).1;
    assert!(alone.refusals.len() > 1 && alone.refusals[0].contains("no packet of this map was"), "{alone:?}");
}

/// Derivatives by absorption and scattering against central differences of fresh traces.
#[test]
#[ignore = "long: cargo xtask accept"]
fn derivatives_are_those_of_fresh_traces() {
    let mut scene = room();
    scene.materials[1].absorption = vec![0.6; 2];
    let wanted = [Parameter::Level, Parameter::T20];
    let mut traced = trace(&scene, 1);
    let receivers = receivers_of(&scene);
    let (mut varied, both) =
        (traced.varied(&receivers, few_rays()), [Coefficient::Absorption, Coefficient::Scattering]);
    let found = varied.vary(&both, &sonel::Silent).expect("a valid map").sensitivities(&wanted);
    for (coefficient, change) in [(Coefficient::Absorption, 0.03), (Coefficient::Scattering, 0.1)] {
        let varied = |by: f64, seed: u64| {
            let mut scene = scene.clone();
            let material = &mut scene.materials[0];
            let values = if coefficient == Coefficient::Absorption {
                &mut material.absorption
            } else {
                &mut material.scattering
            };
            values.iter_mut().for_each(|value| *value += by);
            parameters(&trace(&scene, seed).respond(few_rays()))
        };
        let [less, more] = [varied(-change, 2), varied(change, 3)];
        for parameter in wanted {
            for band in 0..2 {
                let estimate = |parameters: &[ReceiverParameters]| {
                    parameters[0].bands[band].parameter(parameter).clone().expect("a figure")
                };
                let [less, more] = [estimate(&less), estimate(&more)];
                let sigma = |estimate: &sonel_analysis::Estimate| estimate.error.expect("batches").sigma;
                let expected = (more.value - less.value) / (2.0 * change);
                let expected_sigma = sigma(&less).hypot(sigma(&more)) / (2.0 * change);
                let own = |one: &&sonel_analysis::sensitivity::Sensitivity| {
                    one.material == "walls" && one.coefficient == coefficient && one.parameter == parameter
                };
                let slope = found.iter().find(own).expect("all materials").slopes[band].expect("a slope");
                let is_sharp =
                    coefficient == Coefficient::Scattering || expected.abs() > 10.0 * expected_sigma;
                assert!(is_sharp, "too noisy to mean anything: {expected} ± {expected_sigma}");
                // A twentieth for the curvature over the step of the difference.
                let allowed = 4.0 * expected_sigma.hypot(0.5 * slope.half_width) + 0.05 * expected.abs();
                assert!((slope.slope - expected).abs() < allowed, "{slope:?} instead of {expected}");
            }
        }
    }
}

/// With earlier image sources a rendering is the same to the last bit: with others where a wall begins to mirror, which those know nothing of.
#[test]
fn image_sources_are_taken_over_where_materials_leave_them() {
    let scene = two_rooms(Partition::Sheet, [0.2, 0.3], 0.5, &[1e-2, 1e-3]);
    let traced = Traced::new(scene.clone(), Settings { emissions: 64, batches: 4, ..Settings::default() });
    let design = |absorption: f64, scattering: f64| {
        let mut map = traced.map.clone();
        let mut materials = scene.materials.clone();
        (materials[0].absorption, materials[0].scattering) = (vec![absorption; 2], vec![scattering; 2]);
        map.change(materials, scene.sources.clone());
        map
    };
    let (more, dark, now) = (design(0.4, 0.5), design(0.4, 1.0), design(0.2, 0.5));
    let settings = || RenderSettings { rays: Some(64), ..RenderSettings::default() };
    let renderer = |map| Renderer::new(map, &traced.geometry, settings()).expect("a valid map");
    let energies = |renderer: Renderer<'_>| {
        let borders = vec![renderer.bins().edges(); scene.receivers.len()];
        let rendering = renderer.render(0, &receivers_of(&scene), &borders).expect("sound receivers");
        rendering.arrivals.iter().flat_map(|it| it.energy.clone()).collect::<Vec<f64>>()
    };
    let fresh = energies(renderer(&now));
    for earlier in [&more, &dark] {
        let before = renderer(earlier);
        let kept = before.preparation();
        assert_ne!(energies(before), fresh, "the change is too small to be seen");
        assert_eq!(energies(renderer(&now).after(Some(kept))), fresh);
    }
}
