//! What must not matter, in the hall: which end of a path is the source, and where in the world it stands.

use glam::DVec3;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_tests::change::{exchanged, moved};
use sonel_tests::estimates::{Windows, agree_in_windows, windows_with_bias};
use sonel_tests::{Traced, shipped};

/// Borders of the windows [s].
const BORDERS: [f64; 5] = [0.0, 0.08, 0.2, 0.5, 3.0];
/// Largest standard error as a part of the energy in a window.
const LARGEST_ERROR: f64 = 0.05;

/// The hall with one receiver, moved by millimetres from its round coordinates: at the front of the stalls one mirror path
/// meets a block of seats exactly on its edge, where rounding decides whether it is there at all.
fn hall(receiver: usize) -> Scene {
    let mut scene = shipped("hall");
    scene.receivers[receiver].position += DVec3::new(0.0137, 0.0071, 0.0043);
    scene.receivers.swap(0, receiver);
    scene.receivers.truncate(1);
    scene
}

fn received(scene: Scene, seed: u64) -> Vec<Windows> {
    let traced = Traced::new(scene, Settings { emissions: 1_000_000, seed, ..Settings::default() });
    let settings = RenderSettings { rays: Some(65_536), ..RenderSettings::default() };
    windows_with_bias(&traced, settings, &BORDERS).swap_remove(0)
}

/// Disagreements, one sentence each.
fn compare(first: &[Windows], second: &[Windows]) -> Vec<String> {
    let bands = first.iter().zip(second).enumerate();
    bands
        .filter_map(|(band, (first, second))| {
            let error = agree_in_windows(first, second, LARGEST_ERROR).err()?;
            Some(format!("band {band}: {error}\n  {first:?}\n  {second:?}"))
        })
        .collect()
}

/// Direct sound and image-source paths have no noise: each is there from both ends, to rounding.
#[test]
fn mirror_chains_of_the_hall_are_the_same_from_both_ends() {
    let arrivals = |scene: Scene| {
        let settings = RenderSettings { mirror_order: Some(3), rays: Some(64), ..RenderSettings::default() };
        Traced::new(scene, Settings { emissions: 64, ..Settings::default() }).render(settings).arrivals
    };
    for receiver in 0..6 {
        let (there, back) = (arrivals(hall(receiver)), arrivals(exchanged(hall(receiver), 0)));
        assert_eq!(there.len(), back.len(), "receiver {receiver}");
        assert!(there.len() > 15, "receiver {receiver}");
        for (there, back) in there.iter().zip(&back) {
            assert_eq!(there.order, back.order);
            assert!((there.length - back.length).abs() < 1e-9 * back.length, "{there:?} {back:?}");
            for (a, b) in there.energy.iter().zip(&back.energy) {
                assert!((a / b - 1.0).abs() < 1e-8, "{there:?} {back:?}");
            }
        }
    }
}

#[test]
fn source_and_receiver_of_the_hall_may_be_exchanged() {
    for receiver in [0, 3] {
        let there = received(hall(receiver), 1);
        let back = received(exchanged(hall(receiver), 0), 2);
        let wrong = compare(&there, &back);
        assert!(wrong.is_empty(), "receiver {receiver}\n{}", wrong.join("\n"));
        let elsewhere = received(hall((receiver + 1) % 6), 3);
        assert_eq!(compare(&there, &elsewhere).len(), 8, "another seat is told from this one in every band");
    }
}

#[test]
fn the_hall_may_stand_anywhere() {
    let wrong = compare(&received(hall(4), 1), &received(moved(hall(4)), 2));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
