//! What is divided over jobs equals the run in one piece, byte for byte: receivers, and shards that take their decision from one map.

use clap::Parser;
use sonel::study::response::PART;
use sonel_echogram::join;
use sonel_testkit::test_folder::TestFolder;

use crate::{printed, render, response, test_folder, trace};

/// More receivers than are rendered at once, which none of the jobs divides alike.
const GRID: [&str; 7] =
    ["--grid", "0.5:4.5:10,0.6:2.4:7,1.4", "--bin", "0.01", "--directions", "--rays", "16"];

pub(crate) fn merge(folder: &TestFolder, parts: &[&str], output: &str) -> anyhow::Result<String> {
    let place = |name: &&str| folder.path(name).display().to_string();
    let mut line: Vec<String> = ["sonel-analyze", "merge"].map(str::to_owned).to_vec();
    line.extend(
        parts
            .iter()
            .chain([&"-o", &output])
            .map(|word| if *word == "-o" { (*word).to_owned() } else { place(word) }),
    );
    printed(|out| sonel_analyze::run(&sonel_analyze::Arguments::try_parse_from(line)?, out, &mut Vec::new()))
}

fn refusal(result: anyhow::Result<String>) -> String {
    format!("{:#}", result.expect_err("a refusal"))
}

#[test]
fn parts_of_the_receivers_join_to_the_response_in_one_piece() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "200"]).unwrap();
    render(&folder, "a.sonelmap", "whole.npz", &GRID).unwrap();
    for count in [1, 3] {
        let names: Vec<String> = (1..=count).map(|index| format!("{index}.npz")).collect();
        for (index, name) in names.iter().enumerate() {
            let shard = format!("{}/{count}", index + 1);
            render(&folder, "a.sonelmap", name, &[&GRID[..], &["--shard", &shard]].concat()).unwrap();
        }
        let backwards: Vec<&str> = names.iter().rev().map(String::as_str).collect();
        merge(&folder, &backwards, "joined.npz").unwrap();
        assert!(folder.bytes("joined.npz") == folder.bytes("whole.npz"), "{count} parts");
    }
    let of_part = response(&folder, "2.npz").receivers();
    assert!(response(&folder, "whole.npz").receivers() > PART && of_part < PART, "{of_part} receivers");
}

#[test]
fn parts_of_other_renderings_missing_and_doubled_parts_are_refused() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "200"]).unwrap();
    trace(&folder, "b.sonelmap", &["--packets", "200", "--seed", "2"]).unwrap();
    let part = |map: &str, name: &str, more: &[&str]| {
        render(&folder, map, name, &[&GRID[..], more].concat()).unwrap()
    };
    part("a.sonelmap", "1.npz", &["--shard", "1/2"]);
    part("b.sonelmap", "2.npz", &["--shard", "2/2"]);
    let said = refusal(merge(&folder, &["1.npz", "2.npz"], "c.npz"));
    assert!(said.contains("2.npz: map_digest is") && said.contains("seed is 2, but 1 in"), "{said}");
    part("a.sonelmap", "2.npz", &["--shard", "2/2", "--order", "2"]);
    assert!(refusal(merge(&folder, &["1.npz", "2.npz"], "c.npz")).contains("options is"));
    part("a.sonelmap", "3.npz", &["--shard", "2/3"]);
    assert!(refusal(merge(&folder, &["1.npz", "3.npz"], "c.npz")).contains("number of parts is 3, but 2 in"));
    assert!(refusal(merge(&folder, &["1.npz"], "c.npz")).contains("part 2/2 is missing"));
    assert!(refusal(merge(&folder, &["1.npz", "1.npz"], "c.npz")).contains("the same part"));
    part("a.sonelmap", "whole.npz", &[]);
    assert!(refusal(merge(&folder, &["whole.npz"], "c.npz")).contains("not a part of a rendering"));
    assert!(refusal(render(&folder, "a.sonelmap", "d.npz", &["--shard", "2/2"])).contains("at most 1"));
    assert!(!folder.path("c.npz").exists());
}

/// As if another build had rendered it.
#[test]
fn parts_of_two_revisions_are_refused_by_name() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "100"]).unwrap();
    let part = |shard: &str| {
        render(&folder, "a.sonelmap", "a.npz", &[&GRID[..], &["--shard", shard]].concat()).unwrap();
        response(&folder, "a.npz")
    };
    let (one, mut two) = (part("1/2"), part("2/2"));
    two.provenance.tool_version = Some("0.1.0+2.ab".to_owned());
    let problems = join(vec![("1.npz".to_owned(), one), ("2.npz".to_owned(), two)]).unwrap_err();
    let said = problems[0].to_string();
    assert!(
        problems.len() == 1 && said.contains("2.npz: tool_version is \"0.1.0+2.ab\", but \"0.1.0+"),
        "{said}"
    );
}

#[test]
fn shards_with_a_decision_made_once_equal_those_that_decide() {
    let folder = test_folder();
    let place = "[1.0, 1.0, 1.5]\n";
    folder.write(
        "scene.toml",
        crate::SCENE.replace(place, &format!("{place}directivity = \"cardioid\"\naim = [1, 0, 0]\n")),
    );
    for effects in ["auto", "none", "all"] {
        let options = ["--effects", effects];
        trace(&folder, "decision.sonelmap", &[&["--packets", "1", "--batches", "1"][..], &options].concat())
            .unwrap();
        trace(&folder, "anew.sonelmap", &[&["--packets", "2k", "--shard", "2/3"][..], &options].concat())
            .unwrap();
        let map = folder.path("decision.sonelmap").display().to_string();
        trace(&folder, "taken.sonelmap", &["--packets", "2k", "--shard", "2/3", "--decision", &map]).unwrap();
        assert!(folder.bytes("anew.sonelmap") == folder.bytes("taken.sonelmap"), "{effects}");
    }
    let map = folder.path("decision.sonelmap").display().to_string();
    let said = |options: &[&str]| {
        refusal(trace(&folder, "b.sonelmap", &[&["--packets", "100", "--decision", &map], options].concat()))
    };
    assert!(said(&["--mode", "paper"]).contains("decision is for --mode accurate, this run has paper"));
    assert!(said(&["--duration", "0.3"]).contains("decision is for 0.6 s, this run has 0.3 s"));
    assert!(said(&["--effects", "all"]).contains("cannot be used with"));
    folder.write("scene.toml", crate::SCENE.replace("0.6", "0.7"));
    assert!(said(&[]).contains("scene file has digest"));
}
