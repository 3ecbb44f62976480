//! A report is one file with the parameters of `parameters`, whatever names its scene bears.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use clap::Parser;
use flate2::read::GzDecoder;
use serde_json::Value;
use sonel::Parameter;
use sonel_testkit::test_folder::TestFolder;

use crate::{Outcome, SCENE, printed, render, trace};

fn analyze(folder: &TestFolder, words: &[&str]) -> anyhow::Result<String> {
    printed(|out| outcome(folder, words, out))
}

fn outcome(folder: &TestFolder, words: &[&str], out: &mut Vec<u8>) -> anyhow::Result<Outcome> {
    let paths = words.iter().map(|word| {
        if word.contains('.') { folder.path(word).display().to_string() } else { (*word).to_owned() }
    });
    let line: Vec<String> = std::iter::once("sonel-analyze".to_owned()).chain(paths).collect();
    sonel_analyze::run(&sonel_analyze::Arguments::try_parse_from(line)?, out, &mut Vec::new())
}

/// A folder with a map and a response of a scene with names that look like HTML.
fn rendered() -> TestFolder {
    let folder = TestFolder::with(
        &SCENE.replace("Two-coloured", "</script><b>&").replace("\"listener\"", "\"<i>seat</i>\""),
    );
    trace(&folder, "a.sonelmap", &["--packets", "2k"]).expect("a valid scene");
    render(&folder, "a.sonelmap", "a.npz", &[]).expect("a valid map");
    folder
}

/// What stands between two marks.
fn between<'a>(text: &'a str, begin: &str, end: &str) -> &'a str {
    let rest = &text[text.find(begin).expect(begin) + begin.len()..];
    &rest[..rest.find(end).expect(end)]
}

/// What a page shows of `parameter` in the first pair and band, in the unit of its heading.
fn row<'a>(pair: &'a Value, key: &str) -> &'a Value {
    let rows = pair["parameters"].as_array().expect("rows");
    rows.iter().find(|row| row["key"] == key).expect(key)
}

#[test]
fn a_report_needs_no_network_and_has_the_figures_of_parameters() {
    let folder = rendered();
    analyze(&folder, &["report", "a.npz", "a.sonelmap", "-o", "a.html"]).unwrap();
    let page = folder.text("a.html");
    assert!(page.len() < 15_000_000);
    let own = &page[page.find("<body>").unwrap()..];
    assert!(!page.contains("<script src") && !page.contains("<link"));
    let content = content(&page);
    let expected: Value =
        serde_json::from_str(&analyze(&folder, &["parameters", "a.npz", "--format", "json"]).unwrap())
            .unwrap();
    let pairs = content["pairs"].as_array().expect("pairs");
    let receivers = expected["receivers"].as_array().expect("receivers");
    assert_eq!(pairs.len(), receivers.len());
    let mut compared = 0;
    for (pair, receiver) in pairs.iter().zip(receivers) {
        assert_eq!((&pair["source"], &pair["receiver"]), (&receiver["source"], &receiver["name"]));
        for parameter in Parameter::ALL {
            let (key, factor) = (parameter.key(), parameter.heading().2);
            for (shown, band) in
                row(pair, key)["values"].as_array().unwrap().iter().zip(receiver["bands"].as_array().unwrap())
            {
                let (shown, value) = (shown[0].as_f64(), band[key]["value"].as_f64());
                let value = value.map(|value| factor * value);
                let is_near = shown.zip(value).is_none_or(|(a, b)| (a - b).abs() <= 1e-12 * b.abs());
                assert!(is_near && shown.is_some() == value.is_some(), "{key}: {shown:?} {value:?}");
                compared += usize::from(value.is_some());
            }
        }
    }
    assert!(compared > 20, "{compared} values were compared");
    assert_eq!(content["designs"][0]["name"], "a");
    assert!(content["rooms"][0]["trace"]["effects"].as_array().is_some_and(|effects| !effects.is_empty()));
    // Names are text, never markup; and every script ends where it was written to end.
    assert!(own.contains("&lt;/script&gt;&lt;b&gt;&amp;") && !own.contains("<b>&") && !own.contains("<i>"));
    assert_eq!(own.matches("<script").count(), own.matches("</script>").count());
}

/// What the scripts of a page show.
fn content(page: &str) -> Value {
    unpacked(page, "content")
}

fn unpacked(page: &str, id: &str) -> Value {
    let packed = between(page, &format!("id=\"{id}\">"), "</script>");
    let packed = STANDARD.decode(packed).expect("base64 in the page");
    serde_json::from_reader(GzDecoder::new(&packed[..])).expect("JSON in the page")
}

/// Numbers of reflections of the ways of the first pair.
fn orders(content: &Value) -> Vec<u64> {
    let ways = content["pairs"][0]["curves"]["ways"].as_array().expect("ways");
    ways.iter().map(|way| way["order"].as_u64().expect("an order")).collect()
}

/// In a box every wall reflects once, and every pair of different walls twice but for one of both orders of walls that meet; pairs of opposite walls
/// do it in both orders: 6 and 12 + 6.
#[test]
fn early_reflections_are_lines_in_the_room() {
    let folder = rendered();
    analyze(&folder, &["report", "a.npz", "a.sonelmap", "-o", "a.html"]).unwrap();
    let content = content(&folder.text("a.html"));
    let orders = orders(&content);
    let count = |wanted: u64| orders.iter().filter(|order| **order == wanted).count();
    assert_eq!([0, 1, 2].map(count), [1, 6, 18]);
    // One corner for each reflection: the page adds source and receiver.
    let ways = content["pairs"][0]["curves"]["ways"].as_array().expect("ways");
    let corners = |way: &Value| way["corners"].as_array().map(Vec::len);
    assert!(ways.iter().zip(&orders).all(|(way, order)| corners(way) == Some(*order as usize)));
    assert_eq!(content["rooms"][0]["materials"][0]["name"], "walls");
    // Without a map there is no room to draw them in; a response of another map is not followed through this one.
    analyze(&folder, &["report", "a.npz", "-o", "bare.html"]).unwrap();
    assert!(self::orders(&self::content(&folder.text("bare.html"))).is_empty());
    trace(&folder, "b.sonelmap", &["--packets", "1k", "--seed", "7"]).unwrap();
    analyze(&folder, &["report", "a.npz", "b.sonelmap", "-o", "foreign.html"]).unwrap();
    assert!(self::orders(&self::content(&folder.text("foreign.html"))).is_empty());
}

#[test]
fn responses_stand_side_by_side_and_a_foreign_map_is_remarked() {
    let folder = rendered();
    trace(&folder, "b.sonelmap", &["--packets", "1k", "--seed", "7"]).unwrap();
    render(&folder, "b.sonelmap", "b.npz", &[]).unwrap();
    // Files are told by dots: the words have none.
    let client =
        ["--project", "Room <12>", "--date", "today", "--target", "c50>=-99dB", "--target", "t30<=1ms"];
    let files = ["report", "a.npz", "b.npz", "a.sonelmap", "-o", "both.html"];
    // A target is failed.
    assert_eq!(outcome(&folder, &[&files[..], &client].concat(), &mut Vec::new()).unwrap(), Outcome::Missed);
    let page = folder.text("both.html");
    assert!(page.contains("<h1>Room &lt;12&gt;</h1>"));
    let content = content(&page);
    assert_eq!((&content["date"], &content["author"]), (&Value::from("today"), &Value::Null));
    let remarks = content["remarks"].to_string();
    assert!(
        remarks.contains("b was not rendered from this map") && !remarks.contains("a was not"),
        "{remarks}"
    );
    let verdicts = |index: usize| {
        content["requirements"][index]["designs"]
            .as_array()
            .expect("designs")
            .iter()
            .map(|it| it["verdict"].clone())
            .collect::<Vec<_>>()
    };
    assert_eq!((verdicts(0), verdicts(1)), (vec![Value::from("pass"); 2], vec![Value::from("fail"); 2]));
    // A time above 1 ms is beyond its limit by all of the rest.
    let band = &content["requirements"][1]["designs"][0]["bands"][0];
    let [value, beyond] = ["value", "beyond"].map(|key| band[key][0].as_f64().expect("a number"));
    assert!((value - beyond - 0.001).abs() < 1e-12 && band["isAbove"] == true, "{band}");
    // Differences are of the second design alone.
    let pairs = content["pairs"].as_array().expect("pairs");
    let [first, second] = [&pairs[0], &pairs[1]].map(|pair| row(pair, "t30_s"));
    assert!(
        first["less"].is_null()
            && (&pairs[0]["design"], &pairs[1]["design"]) == (&Value::from(0), &Value::from(1))
    );
    let value = |row: &Value| row["single"][0].as_f64().expect("a time");
    assert!((second["less"]["single"][0].as_f64().unwrap() - (value(second) - value(first))).abs() < 1e-12);
    assert_eq!(content["maps"], Value::Array(Vec::new()));
}

/// Designs of different rooms stand on one page, each with its own.
#[test]
fn a_page_holds_several_geometries() {
    let folder = rendered();
    folder.write("scene.toml", SCENE.replace("4.0, 3.0]", "4.0, 2.9]"));
    trace(&folder, "low.sonelmap", &["--packets", "1k"]).unwrap();
    render(&folder, "low.sonelmap", "low.npz", &[]).unwrap();
    analyze(&folder, &["report", "a.npz", "low.npz", "a.sonelmap", "low.sonelmap", "-o", "both.html"])
        .unwrap();
    let content = content(&folder.text("both.html"));
    let volume = |room: usize| content["rooms"][room]["volume"].as_f64().expect("a closed room");
    assert!(volume(1) < volume(0), "{} {}", volume(0), volume(1));
    let rooms: Vec<&Value> = content["designs"].as_array().unwrap().iter().map(|it| &it["room"]).collect();
    assert_eq!(rooms, [&Value::from(0), &Value::from(1)]);
    assert!(
        content["pairs"]
            .as_array()
            .unwrap()
            .iter()
            .all(|pair| pair["curves"]["ways"].as_array().is_some_and(|ways| !ways.is_empty()))
    );
}

#[test]
fn what_makes_no_report_is_refused() {
    let folder = rendered();
    // What-if responses are of the scene of their map.
    render(&folder, "a.sonelmap", "changed.npz", &["--set", "materials.walls.absorption=0.5"]).unwrap();
    analyze(&folder, &["report", "changed.npz", "a.sonelmap", "-o", "changed.html"]).unwrap();
    folder.write("scene.toml", SCENE.replace("4.0, 3.0]", "4.0, 2.9]"));
    trace(&folder, "other.sonelmap", &["--packets", "1k"]).unwrap();
    folder.write("notes.html", "mine");
    for (words, message) in [
        (&["report", "a.npz", "a.sonelmap", "a.sonelmap", "-o", "a.html"][..], "given twice"),
        (&["report", "a.npz", "other.sonelmap", "-o", "a.html"], "a is of another scene than the map"),
        (&["report", "a.npz", "-o", "a.pdf"], "does not end in .html"),
        (&["report", "a.npz", "-o", "notes.html"], "exists and is not a page"),
    ] {
        let error = format!("{:#}", analyze(&folder, words).unwrap_err());
        assert!(error.contains(message), "{words:?}: {error}");
    }
    assert_eq!(folder.text("notes.html"), "mine");
}

/// A grid of receivers is a map of each parameter; materials have their table where they are uncertain.
#[test]
fn many_receivers_are_maps_and_uncertain_materials_a_table() {
    let folder = rendered();
    render(&folder, "a.sonelmap", "grid.npz", &["--grid", "1:4:4,1:3:4,1.2", "--rays", "64"]).unwrap();
    let words = ["report", "grid.npz", "a.sonelmap", "-o", "grid.html", "--material-uncertainty", "5%"];
    analyze(&folder, &words).unwrap();
    let content = content(&folder.text("grid.html"));
    assert_eq!(content["maps"].as_array().map(Vec::len), Some(3), "no speech in three bands");
    assert_eq!(content["maps"][0]["each"][0]["spots"].as_array().map(Vec::len), Some(16));
    assert!(content["designs"][0]["uncertainties"].as_array().is_some_and(|each| !each.is_empty()));
    assert_eq!(
        row(&content["pairs"][0], "t30_s")["single"].as_array().map(Vec::len),
        Some(3),
        "a second interval"
    );
    let without = ["report", "grid.npz", "-o", "grid.html", "--material-uncertainty", "5%"];
    assert!(format!("{:#}", analyze(&folder, &without).unwrap_err()).contains("needs the map"));
}
