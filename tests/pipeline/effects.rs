//! Effects from the scene to the warning: what `sonel-trace` decides, `sonel-render` follows and misses.

use clap::Parser;
use sonel_testkit::test_folder::TestFolder;

use crate::{render, response, trace};

/// A dead room whose receiver sees the source past a screen; behind the screen nothing else is heard.
const SCREENED: &str = r#"
name = "Screened"
mesh = "screened.obj"
duration_s = 0.2

[bands]
center_frequencies_hz = [250, 500]

[materials.walls]
absorption = 0.97
scattering = 0.5

[[sources]]
name = "speaker"
position = [2.0, 5.0, 1.5]

[[receivers]]
name = "in front"
position = [4.0, 5.0, 1.5]
"#;

/// A box of 20 m × 10 m × 4 m and a screen in it at x = 12 m, 2 m high.
const MESH: &str = "
v 0 0 0\nv 20 0 0\nv 20 10 0\nv 0 10 0\nv 0 0 4\nv 20 0 4\nv 20 10 4\nv 0 10 4
v 12 3 0\nv 12 7 0\nv 12 7 2\nv 12 3 2
usemtl walls
f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\nf 9 10 11 12
";

fn folder() -> TestFolder {
    let folder = TestFolder::with(SCREENED);
    folder.write("screened.obj", MESH);
    folder
}

/// What `sonel-render` logs for a receiver behind the screen.
fn log_behind(folder: &TestFolder, map: &str) -> String {
    let options = ["--receiver", "behind=13,5,0.6"];
    let line = folder.line("sonel-render", map, "behind.npz", &options);
    let mut log = Vec::new();
    let arguments = sonel_render::Arguments::try_parse_from(line).expect("sound options");
    sonel_render::run(&arguments, &mut Vec::new(), &mut log).expect("a response");
    String::from_utf8(log).expect("text")
}

fn effect(report: &str, name: &str) -> serde_json::Value {
    let report: serde_json::Value = serde_json::from_str(report).expect("JSON");
    let effects = report["effects"].as_array().expect("effects");
    effects.iter().find(|effect| effect["name"] == name).expect("of every effect").clone()
}

#[test]
fn a_receiver_that_needs_what_was_left_out_is_warned_of() {
    let folder = folder();
    let report = trace(&folder, "auto.sonelmap", &["--sonels", "2k", "--json"]).unwrap();
    let diffraction = effect(&report, "diffraction");
    assert_eq!(diffraction["on"], false, "{diffraction}");
    let bounds = diffraction["level_bound_db"].as_array().unwrap();
    assert!(bounds.iter().all(|bound| bound.as_f64().unwrap() <= 0.1), "{diffraction}");
    assert!(log_behind(&folder, "auto.sonelmap").contains("in the shadow of source \"speaker\""));
    // Those who asked for it need no warning, and with edges there is nothing to warn of.
    for spec in ["auto,-diffraction", "all"] {
        trace(&folder, "asked.sonelmap", &["--sonels", "2k", "--effects", spec]).unwrap();
        assert!(!log_behind(&folder, "asked.sonelmap").contains("warning"), "{spec}");
    }
}

#[test]
fn air_that_is_left_out_for_packets_stays_with_what_is_computed_one_by_one() {
    let folder = folder();
    let report = trace(&folder, "auto.sonelmap", &["--sonels", "2k", "--json"]).unwrap();
    assert_eq!(effect(&report, "air")["on"], false);
    render(&folder, "auto.sonelmap", "auto.npz", &[]).unwrap();
    trace(&folder, "all.sonelmap", &["--sonels", "2k", "--effects", "auto,+air"]).unwrap();
    render(&folder, "all.sonelmap", "all.npz", &[]).unwrap();
    let (auto, all) = (response(&folder, "auto.npz"), response(&folder, "all.npz"));
    assert!(
        !auto.arrivals.energy.is_empty() && auto.arrivals.energy == all.arrivals.energy,
        "exact either way"
    );
    let sum = |energy: &[f64]| energy.iter().sum::<f64>();
    assert!(sum(&auto.energy) > sum(&all.energy), "packets carry air only where it was asked for");
}
