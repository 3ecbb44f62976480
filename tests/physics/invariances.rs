//! What must not matter: which end of a path is the source, where in the world a room stands, who leads, who survives.
//!
//! The two sides of each comparison have seeds of their own, so that their errors are independent. The long form, in the
//! hall, is in `accept`.

use sonel_map::{Settings, Spectral};
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_tests::Traced;
use sonel_tests::change::{exchanged, moved};
use sonel_tests::estimates::{Windows, agree_in_windows, windows};
use sonel_tests::uneven_box::{BORDERS, WILD};

/// Largest standard error as a part of the energy in a window.
const LARGEST_ERROR: f64 = 0.03;

fn settings(seed: u64) -> Settings {
    Settings { emissions: 40_000, seed, ..Settings::default() }
}

fn received(scene: Scene, settings: Settings) -> Vec<Windows> {
    windows(&Traced::new(scene, settings), RenderSettings::default(), &BORDERS).swap_remove(0)
}

fn check(first: &[Windows], second: &[Windows]) {
    for (band, (first, second)) in first.iter().zip(second).enumerate() {
        if let Err(error) = agree_in_windows(first, second, LARGEST_ERROR) {
            panic!("band {band}: {error}\n{first:?}\n{second:?}");
        }
    }
}

/// In every band something differs.
fn check_rejected(first: &[Windows], second: &[Windows]) {
    for (band, (first, second)) in first.iter().zip(second).enumerate() {
        assert!(agree_in_windows(first, second, LARGEST_ERROR).is_err(), "band {band} tells no difference");
    }
}

#[test]
fn source_and_receiver_may_be_exchanged() {
    let there = received(WILD.scene(), settings(1));
    check(&there, &received(exchanged(WILD.scene(), 0), settings(2)));
    let mut elsewhere = exchanged(WILD.scene(), 0);
    elsewhere.receivers[0].position.x += 1.0;
    check_rejected(&there, &received(elsewhere, settings(2)));
}

/// Turned and ten kilometres away, the box is no lattice of images any more but a tree in another place.
#[test]
#[ignore = "long: cargo xtask accept"]
fn a_room_may_stand_anywhere() {
    let here = received(WILD.scene(), settings(1));
    check(&here, &received(moved(WILD.scene()), settings(2)));
    check_rejected(&here, &received(moved(WILD.more_absorbing(0.03).scene()), settings(2)));
}

/// Direct sound and image-source paths are the same paths, to the rounding of the place.
#[test]
fn a_room_far_away_has_the_same_mirror_chains() {
    let arrivals = |scene: Scene| {
        let settings = RenderSettings { mirror_order: Some(4), ..RenderSettings::default() };
        Traced::new(scene, Settings { emissions: 64, ..Settings::default() }).render(settings).arrivals
    };
    let (here, there) = (arrivals(WILD.scene()), arrivals(moved(WILD.scene())));
    assert_eq!(here.len(), 129, "1 + Σ (4 n² + 2)");
    assert_eq!(here.len(), there.len());
    for (here, there) in here.iter().zip(&there) {
        assert!((here.length - there.length).abs() < 1e-9 * here.length, "{here:?} {there:?}");
        assert_eq!(here.order, there.order);
        for (a, b) in here.energy.iter().zip(&there.energy) {
            assert!((a / b - 1.0).abs() < 1e-8, "{here:?} {there:?}");
        }
    }
}

#[test]
fn bands_may_share_paths_or_not() {
    let shared = received(WILD.scene(), settings(1));
    let own = Settings { spectral: Spectral::PerBand, emissions: 10_000, ..settings(2) };
    check(&shared, &received(WILD.scene(), own));
    check_rejected(&shared, &received(WILD.more_absorbing(0.03).scene(), own));
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn survival_decides_about_noise_alone() {
    let usual = received(WILD.scene(), settings(1));
    for (survival, emissions, seed) in [(0.0, 20_000, 2), (0.5, 30_000, 3), (1.0, 350_000, 4)] {
        check(&usual, &received(WILD.scene(), Settings { survival, emissions, ..settings(seed) }));
    }
}
