//! Walks through the shipped hall in steps of 1 cm: nothing that edges leave out or cut off steps by 1 dB.

use glam::{DVec3, dvec3};
use sonel_map::Settings;
use sonel_renderer::{Estimator, PathClass, ReceiverPoint, RenderSettings, Rendering};
use sonel_tests::{Traced, shipped};

/// Places of a walk.
const PLACES: usize = 150;
/// Image sources of so many reflections and their edges are summed one by one; the rest is taken for the same everywhere.
const ORDER: u32 = 3;

/// Out from under the balcony, across the edge of its underside.
const OUT: [DVec3; 2] = [dvec3(-2.0, 26.7, 3.9), DVec3::NEG_Y];
/// Up behind the parapet of the balcony, out of the shadow of direct sound.
const UP: [DVec3; 2] = [dvec3(-3.0, 27.2, 7.503), DVec3::Z];

fn places([start, along]: [DVec3; 2]) -> Vec<ReceiverPoint> {
    let place = |step: usize| ReceiverPoint::omni(&step.to_string(), start + 0.01 * step as f64 * along);
    (0..PLACES).map(place).collect()
}

fn render(traced: &Traced, receivers: &[ReceiverPoint], estimator: Estimator) -> Rendering {
    let settings = RenderSettings {
        estimator,
        rays: Some(1 << 14),
        mirror_order: Some(ORDER),
        ..RenderSettings::default()
    };
    let renderer = traced.renderer(settings);
    let borders = vec![vec![0.0, traced.map.header().scene.duration]; receivers.len()];
    renderer.render(0, receivers, &borders).expect("sound receivers")
}

/// Energy of everything that has noise in the middle of the walk, per band [1/m²].
fn rest(effects: &[&str], places: &[ReceiverPoint]) -> Vec<f64> {
    let traced =
        Traced::with(effects, shipped("hall"), Settings { emissions: 100_000, ..Settings::default() });
    let rendering = render(&traced, &places[PLACES / 2..=PLACES / 2], Estimator::Auto);
    let exact = [PathClass::Direct, PathClass::ImageSource, PathClass::Edge];
    let mut sums = vec![0.0; traced.map.header().scene.bands.count()];
    for (_, energies) in rendering.classes.iter().filter(|(class, _)| !exact.contains(class)) {
        sums.iter_mut().zip(energies).for_each(|(sum, energy)| *sum += energy);
    }
    sums
}

/// Change of the level between neighbours, the largest of all bands [dB].
fn steps(walk: [DVec3; 2], effects: &[&str]) -> Vec<f64> {
    let places = places(walk);
    let mut energies = vec![rest(effects, &places); PLACES];
    let traced = Traced::with(effects, shipped("hall"), Settings { emissions: 32, ..Settings::default() });
    for arrival in render(&traced, &places, Estimator::Connection).arrivals {
        let sums = energies[arrival.receiver].iter_mut();
        sums.zip(&arrival.energy).for_each(|(sum, energy)| *sum += energy);
    }
    let change = |(a, b): (&f64, &f64)| (10.0 * (a / b).log10()).abs();
    energies.windows(2).map(|pair| pair[0].iter().zip(&pair[1]).map(change).fold(0.0, f64::max)).collect()
}

/// The largest, and between which places.
fn largest(steps: &[f64]) -> (usize, f64) {
    steps.iter().copied().enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b)).expect("several places")
}

#[test]
fn walks_through_the_hall_have_no_steps() {
    let [out, up, without] = [(OUT, &["diffraction"][..]), (UP, &["diffraction"]), (UP, &[])]
        .map(|(walk, effects)| steps(walk, effects));
    let (at, step) = largest(&without);
    println!(
        "largest step of 1 cm: out {:.3} dB, up {:.3} dB, without diffraction {step:.3} dB, there with it {:.3} dB",
        largest(&out).1,
        largest(&up).1,
        up[at]
    );
    assert!(largest(&out).1 < 1.0 && largest(&up).1 < 1.0);
    assert!(step > 3.0 * up[at], "where direct sound appears, a walk without diffraction has to step");
}
