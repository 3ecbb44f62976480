//! Boxes against a slow and obvious simulator: each class of path and each window of time, in bands and at walls that differ.
//!
//! The long form is in `accept`.

use sonel_tests::uneven_box::{Effort, UnevenBox, WILD, disagreements};

const EFFORT: Effort = Effort { rays_per_batch: 8_000, emissions: 1_600, runs: 16, largest_error: 0.02 };

#[test]
fn bands_and_walls_that_differ_wildly() {
    let wrong = disagreements(&WILD, &WILD, EFFORT);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn walls_of_one_kind() {
    let room = UnevenBox::even(0.2, 0.5);
    let wrong = disagreements(&room, &room, EFFORT);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Floor and ceiling exchanged, or a scattering that is applied twice: the same comparison finds both.
#[test]
fn wrong_rooms_are_rejected() {
    for wrong in [WILD.exchanged(4, 5), squared_scattering(WILD)] {
        let found = disagreements(&WILD, &wrong, EFFORT);
        let told = |band: usize| found.iter().any(|text| text.starts_with(&format!("band {band}")));
        assert!(told(0) && told(1) && told(2) && told(3), "{}", found.join("\n"));
        assert!(found.iter().all(|text| !text.contains("take more")), "{}", found.join("\n"));
    }
}

fn squared_scattering(mut room: UnevenBox) -> UnevenBox {
    room.scattering.iter_mut().flatten().for_each(|scattering| *scattering *= *scattering);
    room
}
