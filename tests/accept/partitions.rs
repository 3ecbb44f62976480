//! Two rooms with a wall: the double slope of their power balance, and intervals behind the wall.

use sonel_map::Settings;
use sonel_renderer::{Estimator, RenderSettings};
use sonel_scene::Scene;
use sonel_tests::coupled_door::{DOOR, uncoupled};
use sonel_tests::estimates::windows;
use sonel_tests::two_rooms::{Partition, SIZE, SPEED, partition_area, two_rooms};
use sonel_tests::{Traced, shipped};

use crate::coverage::{Run, check};

const TRANSMISSION: f64 = 0.05;
const ABSORPTION: [f64; 2] = [0.3, 0.1];
/// Two windows of the steep part and two of the late part of the decay in the first room [s].
const STEEP: [f64; 4] = [0.04, 0.08, 0.10, 0.14];
const LATE: [f64; 4] = [0.4, 0.6, 0.6, 0.8];

/// Decay constant [1/s] between two windows of equal width of the energy at the first receiver.
fn constant(scene: &Scene, [a, b, c, d]: [f64; 4]) -> f64 {
    let traced = Traced::new(scene.clone(), Settings { emissions: 400_000, ..Settings::default() });
    // What is before the first border and behind the last would be in the outer windows.
    let mut borders = vec![0.0, a, b, c, d, scene.duration];
    borders.dedup();
    let found = &windows(&traced, RenderSettings::default(), &borders)[0][0];
    let (first, last) = (found[1], found[found.len() - 2]);
    let error = (first.sigma / first.value).hypot(last.sigma / last.value) / (c - a);
    let constant = (first.value / last.value).ln() / (c - a);
    assert!(error < 0.01 * constant, "too noisy to mean anything: {constant} ± {error}");
    constant
}

/// The same of the energy in the first of two coupled reservoirs with the decay constants `k` of their own, of which `between` changes
/// sides.
fn reservoirs([k1, k2]: [f64; 2], between: f64, [a, b, c, _]: [f64; 4]) -> f64 {
    let (mean, half) = (0.5 * (k1 + k2), 0.5 * (k1 - k2));
    let root = half.hypot(between);
    let energy = |t: f64| (-mean * t).exp() * ((root * t).cosh() - half / root * (root * t).sinh());
    let window =
        |from: f64| (0..1000).map(|i| energy(from + (b - a) * (f64::from(i) + 0.5) / 1000.0)).sum::<f64>();
    (window(a) / window(c)).ln() / (c - a)
}

/// Both slopes of `coupled` against the reservoirs whose own constants are those of `first` and `second`, alone.
fn check_slopes(coupled: &Scene, first: &Scene, mut second: Scene, area: f64) {
    // Source and receiver change sides.
    second.sources[0].position.x = 2.0 * SIZE.x - second.sources[0].position.x;
    second.receivers.retain(|receiver| receiver.position.x > SIZE.x);
    let own = [constant(first, STEEP), constant(&second, LATE)];
    let between = SPEED * area / (4.0 * SIZE.element_product());
    for part in [STEEP, LATE] {
        let (found, expected) = (constant(coupled, part), reservoirs(own, between, part));
        println!("{found} against {expected} 1/s, alone {own:?}");
        assert!((found / expected - 1.0).abs() < 0.03, "{found} instead of {expected} 1/s");
    }
    assert!(own[0] > 2.0 * own[1], "the slopes are too much alike to be told apart");
}

#[test]
fn coupled_rooms_have_the_double_slope_of_two_reservoirs() {
    let with = |transmission: f64| two_rooms(Partition::Sheet, ABSORPTION, 1.0, &[transmission]);
    check_slopes(&with(TRANSMISSION), &with(0.0), with(0.0), TRANSMISSION * partition_area());
}

#[test]
fn so_have_rooms_coupled_through_a_door() {
    let mut scene = shipped("coupled-door").without_air_attenuation();
    scene.speed_of_sound = SPEED;
    let alone = uncoupled(scene.clone());
    check_slopes(&scene, &alone, alone.clone(), DOOR);
}

#[test]
fn intervals_hold_behind_a_wall() {
    let mut scene = two_rooms(Partition::Sheet, [0.2; 2], 0.5, &[1e-3]);
    scene.receivers.remove(0);
    check(&scene, Run { emissions: 50_000, band: 0, estimator: Estimator::Auto });
}
