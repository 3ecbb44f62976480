//! How long a run is whose scene states no duration.

use clap::Parser;
use sonel_analysis::{Parameter, parameters};
use sonel_testkit::test_folder::TestFolder;

use crate::{printed, render, response, trace};

/// A classroom of hard walls under an absorbing ceiling: Sabine's time is 0.45 s, and T30 is three times as long.
const CLASSROOM: &str = r#"
shoebox = [9.0, 7.0, 3.0]

[bands]
center_frequencies_hz = [500, 1000]

[materials.walls]
absorption = 0.04
scattering = 0.1

[materials.z1]
absorption = [0.7, 0.9]
scattering = 0.1

[[sources]]
position = [1.5, 3.5, 1.5]

[[receivers]]
name = "front"
position = [3.0, 2.0, 1.2]

[[receivers]]
name = "back"
position = [7.8, 5.6, 1.2]
"#;

#[test]
fn a_classroom_has_t30_at_every_seat_without_a_duration() {
    let folder = TestFolder::with(CLASSROOM);
    let t30 = |options: &[&str]| {
        trace(&folder, "a.sonelmap", &[&["--packets", "3k"][..], options].concat()).unwrap();
        render(&folder, "a.sonelmap", "a.npz", &[]).unwrap();
        let seats = parameters(&response(&folder, "a.npz"));
        let bands = seats.iter().flat_map(|seat| &seat.bands);
        bands.map(|band| band.parameter(Parameter::T30).clone()).collect::<Vec<_>>()
    };
    let found = t30(&[]);
    assert_eq!(found.len(), 4);
    for time in found {
        let time = time.expect("T30 of the classroom").value;
        assert!(time > 0.8, "{time}");
    }
    // What 1.2 times the Sabine time would bring.
    assert!(t30(&["--duration", "0.61"]).iter().any(Result::is_err));
}

/// Every shard finds the length by itself, or takes it from a map.
#[test]
fn all_shards_of_a_run_have_the_same_length() {
    let folder = TestFolder::with(CLASSROOM);
    trace(&folder, "decision.sonelmap", &["--packets", "1", "--batches", "1"]).unwrap();
    let map = folder.path("decision.sonelmap").display().to_string();
    let part = |name: &str, options: &[&str]| {
        trace(&folder, name, &[&["--packets", "3k", "--shard", "2/2"][..], options].concat()).unwrap();
        folder.bytes(name)
    };
    let found = part("found.sonelmap", &[]);
    assert!(found == part("taken.sonelmap", &["--decision", &map]), "the length of the decision is another");
    assert!(found != part("short.sonelmap", &["--duration", "0.61"]));
}

#[test]
fn a_checkup_names_uneven_absorption() {
    let notes = |scene: &str| {
        let folder = TestFolder::with(scene);
        let file = folder.path("scene.toml").display().to_string();
        let program =
            sonel_trace::Program::try_parse_from(["sonel-trace", "check", &file, "--json"]).unwrap();
        printed(|out| program.run(out, &mut Vec::new())).unwrap()
    };
    assert!(notes(CLASSROOM).contains("absorption is uneven: at"));
    assert!(!notes(&CLASSROOM.replace("0.04", "0.5")).contains("uneven"));
}
