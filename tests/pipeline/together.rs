//! Sources as one system: gains and delays of the scene go through map and response, and options replace them one by one.

use clap::Parser;
use sonel_acoustics::SourceChange;
use sonel_console::heard::HeardArguments;

use super::{SCENE, TestFolder, render, response, trace};

/// Options as of a program.
#[derive(Parser)]
struct Options {
    #[command(flatten)]
    heard: HeardArguments,
}

fn heard(options: &[&str]) -> HeardArguments {
    Options::parse_from([&["program"], options].concat()).heard
}

const DELAY: &str =
    "\n[[sources]]\nname = \"rear\"\nposition = [4.0, 3.0, 2.5]\ngain_db = -6\ndelay_s = 0.012\n";

#[test]
fn gains_and_delays_of_the_scene_are_the_defaults_of_together() {
    let folder = TestFolder::with(&format!("{SCENE}{DELAY}"));
    trace(&folder, "a.sonelmap", &["--packets", "200"]).expect("traced");
    render(&folder, "a.sonelmap", "a.npz", &[]).expect("rendered");
    let response = response(&folder, "a.npz");
    let rear = SourceChange { gain_db: -6.0, delay: 0.012 };
    let changes = |options: &[&str]| heard(options).changes(&response).expect("valid");
    assert_eq!(changes(&[]), None);
    assert_eq!(changes(&["--together"]), Some(vec![SourceChange::default(), rear]));
    let louder = Some(vec![SourceChange::default(), SourceChange { gain_db: 2.0, ..rear }]);
    assert_eq!(changes(&["--together", "--gain", "rear=2"]), louder);
    let later = SourceChange { gain_db: 0.0, delay: 0.005 };
    let both = ["--together", "--delay", "speaker=5", "--delay", "rear=0"];
    assert_eq!(changes(&both), Some(vec![later, SourceChange { delay: 0.0, ..rear }]));
    // What the second radiates arrives 12 ms later.
    let system = heard(&["--together"]).heard(response).expect("one system");
    let times: Vec<f64> = system
        .arrivals
        .order
        .iter()
        .zip(&system.arrivals.time_s)
        .filter(|(order, _)| **order == 0)
        .map(|(_, time)| *time)
        .collect();
    let from =
        |x: f64, y: f64, z: f64| ((3.9 - x).powi(2) + (2.8 - y).powi(2) + (1.2 - z).powi(2)).sqrt() / 343.0;
    let expected = [from(1.0, 1.0, 1.5), from(4.0, 3.0, 2.5) + 0.012];
    assert!(
        times.len() == 2 && times.iter().zip(expected).all(|(found, time)| (found - time).abs() < 1e-9),
        "{times:?}"
    );
    let error = |options: &[&str]| {
        heard(options).changes(&super::response(&folder, "a.npz")).expect_err("refused").to_string()
    };
    assert_eq!(
        error(&["--together", "--delay", "rear=1001"]),
        "delay of \"rear\": 1001 ms is outside 0 … 1000 ms"
    );
    assert_eq!(
        error(&["--together", "--gain", "rear=-101"]),
        "gain of \"rear\": -101 dB is outside -100 … 100 dB"
    );
}

#[test]
fn tables_state_the_system_and_refuse_intervals_of_its_materials() {
    let folder = TestFolder::with(&format!("{SCENE}{DELAY}"));
    trace(&folder, "a.sonelmap", &["--packets", "200"]).expect("traced");
    render(&folder, "a.sonelmap", "a.npz", &[]).expect("rendered");
    let [map, file] = ["a.sonelmap", "a.npz"].map(|name| folder.path(name).display().to_string());
    let analyze = |options: &[&str]| {
        let line = [&["sonel-analyze", "parameters", &file, "--together"], options].concat();
        let arguments = sonel_analyze::Arguments::try_parse_from(line).expect("options");
        let mut out = Vec::new();
        sonel_analyze::run(&arguments, &mut out, &mut Vec::new()).map_err(|error| format!("{error:#}"))?;
        Ok::<_, String>(String::from_utf8(out).expect("text"))
    };
    let table = analyze(&["--gain", "speaker=1.5"]).expect("a table");
    assert!(table.contains(", sources \"speaker 1.5 dB + rear −6 dB 12 ms\": source"), "{table}");
    let refused = analyze(&["--map", &map, "--material-uncertainty", "0.05"]).expect_err("two options");
    assert!(refused.contains("(--together)") && refused.contains("(--material-uncertainty)"), "{refused}");
}
