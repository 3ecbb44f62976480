//! What must not matter, in the hall: which end of a path is the source, and where in the world it stands.

use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_tests::change::{exchanged, moved};
use sonel_tests::estimates::{Windows, agree_in_windows, windows};
use sonel_tests::{Traced, shipped};

/// Borders of the windows [s].
const BORDERS: [f64; 6] = [0.0, 0.08, 0.2, 0.5, 1.0, 3.0];
/// Largest standard error as a part of the energy in a window.
const LARGEST_ERROR: f64 = 0.02;

/// The hall with one receiver.
fn hall(receiver: usize) -> Scene {
    let mut scene = shipped("hall");
    scene.receivers.swap(0, receiver);
    scene.receivers.truncate(1);
    scene
}

fn heard(scene: Scene, seed: u64) -> Vec<Windows> {
    let traced = Traced::new(scene, Settings { emissions: 200_000, seed, ..Settings::default() });
    let settings = RenderSettings { rays: 65_536, ..RenderSettings::default() };
    windows(&traced, settings, &BORDERS).swap_remove(0)
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

#[test]
fn source_and_receiver_of_the_hall_may_be_exchanged() {
    for receiver in [0, 3, 5] {
        let there = heard(hall(receiver), 1);
        let back = heard(exchanged(hall(receiver), 0), 2);
        let wrong = compare(&there, &back);
        assert!(wrong.is_empty(), "receiver {receiver}\n{}", wrong.join("\n"));
        let elsewhere = heard(hall((receiver + 1) % 6), 3);
        assert_eq!(compare(&there, &elsewhere).len(), 8, "another seat is told from this one in every band");
    }
}

#[test]
fn the_hall_may_stand_anywhere() {
    for receiver in [1, 3] {
        let wrong = compare(&heard(hall(receiver), 1), &heard(moved(hall(receiver)), 2));
        assert!(wrong.is_empty(), "receiver {receiver}\n{}", wrong.join("\n"));
    }
}
