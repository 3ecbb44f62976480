//! Boxes against a slow and obvious simulator, to some thousandths: each class of path, each window of time, in bands and at
//! walls that differ.

use sonel_tests::uneven_box::{Effort, Rendered, UnevenBox, WILD};

const EFFORT: Effort = Effort {
    rays_per_batch: 250_000,
    radius: 0.25,
    emissions: 20_000,
    runs: 32,
    class_error: 0.004,
    window_error: 0.015,
};

#[test]
fn classes_and_windows_of_uneven_boxes() {
    let mut smooth = WILD;
    smooth.scattering.iter_mut().flatten().for_each(|scattering| *scattering *= 0.2);
    for room in [WILD, smooth, UnevenBox::even(0.2, 0.5)] {
        let wrong = Rendered::of(&room, EFFORT).disagreements(&room);
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}

/// A hundredth of absorption is found out.
#[test]
fn a_slightly_wrong_box_is_rejected() {
    let wrong = Rendered::of(&WILD, EFFORT).disagreements(&WILD.more_absorbing(0.01));
    for band in 0..4 {
        assert!(wrong.iter().any(|text| text.starts_with(&format!("band {band}"))), "{}", wrong.join("\n"));
    }
}
