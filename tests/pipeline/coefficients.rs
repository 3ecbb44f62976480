//! `fit` and `optimise` as a user runs them: tables, files and what they say of bad input.

use clap::Parser;
use sonel_testkit::test_folder::TestFolder;

use crate::{SCENE, printed, render, trace};

fn analyze(folder: &TestFolder, words: &[&str]) -> anyhow::Result<String> {
    analyze_with_log(folder, words, &mut Vec::new())
}

fn analyze_with_log(folder: &TestFolder, words: &[&str], log: &mut Vec<u8>) -> anyhow::Result<String> {
    let is_file = |word: &str| [".sonelmap", ".npz", ".csv", ".toml"].iter().any(|end| word.ends_with(end));
    let path = |word: &&str| {
        if is_file(word) { folder.path(word).display().to_string() } else { (*word).to_owned() }
    };
    let line = std::iter::once("sonel-analyze".to_owned()).chain(words.iter().map(path));
    let line: Vec<String> = line.collect();
    printed(|out| sonel_analyze::run(&sonel_analyze::Arguments::try_parse_from(line)?, out, log))
}

/// A map, and the table of the parameters that it has.
fn folder() -> TestFolder {
    let folder = TestFolder::with(SCENE);
    trace(&folder, "a.sonelmap", &["--packets", "2k"]).expect("a valid scene");
    render(&folder, "a.sonelmap", "a.npz", &["--rays", "2k"]).expect("a valid map");
    let table = analyze(&folder, &["parameters", "a.npz", "--format", "csv"]).expect("a response");
    folder.write("a.csv", table);
    folder
}

const FIT: [&str; 8] = ["fit", "a.sonelmap", "--measured", "a.csv", "-o", "fitted.toml", "--rays", "2k"];

/// The table of the map's own parameters changes nothing, and what is written is read by sonel-render.
#[test]
fn a_table_of_parameters_is_fitted_as_it_is() {
    let folder = folder();
    let text = analyze(&folder, &[&FIT[..], &["--format", "csv"]].concat()).unwrap();
    let mut rows = 0;
    for row in text.lines().skip(1) {
        let fields: Vec<&str> = row.split(',').collect();
        let [start, value, low, high] =
            [3, 4, 5, 6].map(|column: usize| fields[column].parse::<f64>().unwrap());
        assert!(low < value && value < high && (value - start).abs() < 0.02, "{row}");
        rows += 1;
    }
    assert_eq!(rows, 6, "two materials in three bands");
    render(
        &folder,
        "a.sonelmap",
        "b.npz",
        &["--materials", &folder.path("fitted.toml").display().to_string()],
    )
    .expect("materials of the map");
    // The second run replaces the file of the first.
    let table = analyze(&folder, &[&FIT[..], &["--scattering"]].concat()).unwrap();
    assert!(table.contains("scattering") && table.contains("95 %") && table.contains("EDT"), "{table}");
}

/// From 0.7 to 0.15: packets that the start would absorb carry the late decay, so that paths are traced anew on the way. Its sibling is
/// the test above, whose log has no such line.
#[test]
fn a_room_far_from_the_start_is_traced_anew_on_the_way() {
    let walls = |absorption: f64| {
        SCENE
            .replace("[0.2, 0.3, 0.4]", &absorption.to_string())
            .replace("[materials.z0]\nabsorption = 0.5\nscattering = [0.1, 0.5, 0.9]\n", "")
            .replace("duration_s = 0.6", "duration_s = 1.2")
    };
    let folder = TestFolder::with(&walls(0.15));
    trace(&folder, "a.sonelmap", &["--packets", "4k", "--seed", "2"]).expect("a valid scene");
    render(&folder, "a.sonelmap", "a.npz", &["--rays", "2k"]).expect("a valid map");
    folder.write("a.csv", analyze(&folder, &["parameters", "a.npz", "--format", "csv"]).expect("a response"));
    folder.write("scene.toml", walls(0.7));
    trace(&folder, "b.sonelmap", &["--packets", "4k"]).expect("a valid scene");
    let mut log = Vec::new();
    let words =
        ["fit", "b.sonelmap", "--measured", "a.csv", "-o", "f.toml", "--rays", "2k", "--prior-sigma", "3"];
    let text = analyze_with_log(
        &folder,
        &[&words[..], &["--format", "csv", "--use", "t20,level"]].concat(),
        &mut log,
    );
    let (text, log) = (text.unwrap(), String::from_utf8(log).unwrap());
    assert!(log.contains("the scene is traced with the new coefficients:"), "{log}");
    assert!(!log.contains("did not settle"), "{log}");
    for row in text.lines().skip(1) {
        let fields: Vec<f64> = row.split(',').skip(3).take(4).map(|field| field.parse().unwrap()).collect();
        assert!(fields[2] < 0.15 && 0.15 < fields[3] && fields[3] < 0.3, "{row}");
    }
}

#[test]
fn a_wish_is_fulfilled_by_an_entry_or_within_bounds() {
    let folder = folder();
    let words = ["optimise", "a.sonelmap", "--goal", "t20=0.22s±10%@500", "-o", "changed.toml"];
    let change = ["--change", "walls=0.05:0.9", "--change", "z0=carpet-heavy-on-felt", "--price", "z0=100"];
    let text = analyze(&folder, &[&words[..], &change[..]].concat()).unwrap();
    assert!(
        text.contains("walls: absorption 0.300 →") && text.contains("4 combinations") && text.contains("met"),
        "{text}"
    );
    assert!(folder.text("changed.toml").starts_with("# sonel-analyze optimise"));
}

#[test]
fn everything_that_is_wrong_is_said() {
    let folder = folder();
    folder.write(
        "bad.csv",
        "receiver,center_frequency_hz,parameter,value\nhere,500,t20_s,1\nlistener,440,t20_s,1\n",
    );
    folder.write("mine.toml", "[materials.walls]\nabsorption = 0.1\n");
    let optimise = |goal: &'static str, change: &'static str| {
        ["optimise", "a.sonelmap", "--goal", goal, "--change", change, "-o", "c.toml"]
    };
    let fit =
        |table: &'static str, output: &'static str| ["fit", "a.sonelmap", "--measured", table, "-o", output];
    for (words, messages) in [
        (
            &fit("bad.csv", "f.toml")[..],
            &["line 2: the map has no receiver \"here\"", "line 3: the map has no band of 440 Hz"][..],
        ),
        (&fit("a.csv", "mine.toml"), &["exists and is not materials written by sonel-analyze"]),
        (&optimise("t20=1s", "walls=0.1:0.5"), &["is not a goal"]),
        (&optimise("t20=1s±5%@440", "walls=0.1:0.5"), &["no band of 440 Hz"]),
        (&optimise("t20=1s±5%", "roof=0.1:0.5"), &["no material \"roof\"; it has \"walls\", \"z0\""]),
        (&optimise("t20=1s±5%", "walls=0.5:0.1"), &["not bounds of absorption"]),
        (&optimise("t20=1s±5%", "walls=marzipan"), &["marzipan"]),
    ] {
        let error = format!("{:#}", analyze(&folder, words).unwrap_err());
        for message in messages {
            assert!(error.contains(message), "{words:?}: {error}");
        }
    }
}
