//! A report is one file with the parameters of `parameters`, whatever names its scene bears.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use clap::Parser;
use flate2::read::GzDecoder;
use serde_json::Value;
use sonel_testkit::test_folder::TestFolder;

use crate::{SCENE, printed, render, trace};

fn analyze(folder: &TestFolder, words: &[&str]) -> anyhow::Result<String> {
    let paths = words.iter().map(|word| {
        if word.contains('.') { folder.path(word).display().to_string() } else { (*word).to_owned() }
    });
    let line: Vec<String> = std::iter::once("sonel-analyze".to_owned()).chain(paths).collect();
    printed(|out| sonel_analyze::run(&sonel_analyze::Arguments::try_parse_from(line)?, out, &mut Vec::new()))
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

#[test]
fn a_report_needs_no_network_and_has_the_figures_of_parameters() {
    let folder = rendered();
    analyze(&folder, &["report", "a.npz", "a.sonelmap", "-o", "a.html"]).unwrap();
    let page = folder.text("a.html");
    assert!(page.len() < 15_000_000);
    let own = &page[page.find("<body>").unwrap()..];
    assert!(!page.contains("<script src") && !page.contains("<link"));
    let parameters = unpacked(&page, "figures");
    let expected: Value =
        serde_json::from_str(&analyze(&folder, &["parameters", "a.npz", "--format", "json"]).unwrap())
            .unwrap();
    assert_eq!(parameters["receivers"], expected["receivers"]);
    assert!(expected["receivers"].as_array().is_some_and(|receivers| !receivers.is_empty()));
    for section in
        ["Summary", "Remarks", "Materials", "Overfrequencyinnumbers", "Effects", "Energyledger", "Provenance"]
    {
        assert!(own.contains(&format!("<h2 id=\"{section}\">")), "{section}");
    }
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
    let ways = content["pairs"][0]["ways"].as_array().expect("ways");
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
    let ways = content["pairs"][0]["ways"].as_array().expect("ways");
    let corners = |way: &Value| way["corners"].as_array().map(Vec::len);
    assert!(ways.iter().zip(&orders).all(|(way, order)| corners(way) == Some(*order as usize)));
    assert_eq!(content["room"]["materials"][0]["name"], "walls");
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
    analyze(&folder, &[&files[..], &client].concat()).unwrap();
    let page = folder.text("both.html");
    for text in
        ["<h1>Room &lt;12&gt;</h1>", "<p>today</p>", "<td>pass</td>", "<td>fail</td>", "id=\"Differences\""]
    {
        assert!(page.contains(text), "{text}");
    }
    let page = folder.text("both.html");
    assert!(
        page.contains("b was not rendered from this map")
            && !page.contains("a was not rendered from this map")
    );
    assert!(page.contains("<td>a: speaker") && page.contains("<td>b: speaker"));
    // Every receiver has its table, of responses side by side.
    assert_eq!(page.matches("<details class=\"fold\">").count(), 1);
    assert!(page.contains("<th>b − a</th>") && !page.contains("id=\"Maps\""));
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
        (&["report", "a.npz", "a.sonelmap", "a.sonelmap", "-o", "a.html"][..], "second map"),
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
    let page = folder.text("grid.html");
    assert_eq!(page.matches("src=\"data:image/svg+xml").count(), 3, "no speech in three bands");
    assert!(page.contains("id=\"Uncertaintyofthematerials\"") && page.contains("<td>z0</td>"));
    assert!(page.contains("second interval") && !page.contains("The uncertainty of the materials."));
    let without = ["report", "grid.npz", "-o", "grid.html", "--material-uncertainty", "5%"];
    assert!(format!("{:#}", analyze(&folder, &without).unwrap_err()).contains("needs the map"));
}
