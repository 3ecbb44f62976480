//! Boxes against a slow and obvious simulator: each class of path and each window of time, in bands and at walls that differ.
//!
//! The long form is in `accept`, with a room whose walls and bands are alike.

use sonel_tests::uneven_box::{BANDS, Effort, Rendered, UnevenBox, WILD};

const EFFORT: Effort = Effort {
    rays_per_batch: 12_000,
    radius: 0.4,
    emissions: 1_600,
    runs: 16,
    class_error: 0.015,
    window_error: 0.035,
};

/// The bands in which `wrong`, counted, is told from the room that was `rendered`. None may be for want of rays.
fn told(rendered: &Rendered, wrong: &UnevenBox) -> Vec<usize> {
    let found = rendered.disagreements(wrong);
    assert!(found.iter().all(|text| !text.contains("take more")), "{}", found.join("\n"));
    (0..BANDS).filter(|band| found.iter().any(|text| text.starts_with(&format!("band {band}")))).collect()
}

/// Bands and walls that differ wildly are right; wrong are three hundredths of absorption, scattering applied twice, floor and
/// ceiling exchanged.
#[test]
#[ignore = "long: cargo xtask accept"]
fn rooms_that_differ_wildly_are_told_from_wrong_ones() {
    let rendered = Rendered::of(&WILD, EFFORT);
    let wrong = rendered.disagreements(&WILD);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let mut twice = WILD;
    twice.scattering.iter_mut().flatten().for_each(|scattering| *scattering *= *scattering);
    assert_eq!(told(&rendered, &WILD.more_absorbing(0.03)), [0, 1, 2, 3]);
    assert_eq!(told(&rendered, &twice), [0, 1, 2, 3]);
    assert!(!told(&rendered, &WILD.exchanged(4, 5)).is_empty());
}
