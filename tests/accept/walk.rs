//! Walks through the shipped hall in steps of 1 cm: nothing that edges leave out or cut off steps by 1 dB.

use glam::{DVec3, dvec3};
use rayon::prelude::*;
use sonel_map::Settings;
use sonel_renderer::{Estimator, PathClass, ReceiverPoint, RenderSettings, Renderer};
use sonel_tests::{Traced, shipped};

/// Places of a walk.
const PLACES: usize = 150;
/// Length of the batches' windows, of which nothing is used [s].
const DURATION: f64 = 1.0;
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

/// Energy at a place of the classes without noise, or of all others, per band [1/m²].
fn energies(renderer: &Renderer<'_>, place: &ReceiverPoint, is_exact: bool) -> Vec<f64> {
    let place = std::slice::from_ref(place);
    let rendering = renderer.render(0, place, &[vec![0.0, DURATION]]).expect("a sound receiver");
    let exact = [PathClass::Direct, PathClass::ImageSource, PathClass::Edge];
    let classes = rendering.classes.iter().filter(|(class, _)| exact.contains(class) == is_exact);
    let add = |sums: Vec<f64>, energies: &Vec<f64>| sums.iter().zip(energies).map(|(a, b)| a + b).collect();
    classes
        .map(|(_, energies)| energies.clone())
        .reduce(|sums, energies| add(sums, &energies))
        .expect("classes")
}

/// Change of the level between neighbours, the largest of all bands [dB].
fn steps(walk: [DVec3; 2], effects: &[&str]) -> Vec<f64> {
    let places = places(walk);
    let traced =
        |emissions| Traced::with(effects, shipped("hall"), Settings { emissions, ..Settings::default() });
    let settings = |estimator| RenderSettings {
        estimator,
        rays: Some(1 << 14),
        mirror_order: Some(ORDER),
        ..RenderSettings::default()
    };
    let (many, few) = (traced(100_000), traced(32));
    // What has noise, in the middle of the walk.
    let rest = energies(&many.renderer(settings(Estimator::Auto)), &places[PLACES / 2], false);
    let renderer = few.renderer(settings(Estimator::Connection));
    let exact: Vec<_> = places.par_iter().map(|place| energies(&renderer, place, true)).collect();
    let change = |((a, b), rest): ((&f64, &f64), &f64)| (10.0 * ((a + rest) / (b + rest)).log10()).abs();
    let step = |pair: &[Vec<f64>]| pair[0].iter().zip(&pair[1]).zip(&rest).map(change).fold(0.0, f64::max);
    exact.windows(2).map(step).collect()
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
