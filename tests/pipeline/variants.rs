//! Maps that carry variants of materials: the same bytes in shards and extended, and the answer to a question that another map refuses.

use sonel_testkit::test_folder::TestFolder;

use crate::parts::merge;
use crate::{render, response, test_folder, trace};

/// Floor and walls, with absorption and scattering of their own.
const FOR: [&str; 4] =
    ["--for", "materials.walls.absorption=[0.1,0.2,0.2],0.9", "--for", "materials.z0.scattering=0.3"];

fn complaint(result: anyhow::Result<String>) -> String {
    format!("{:#}", result.expect_err("a refusal"))
}

fn traced(folder: &TestFolder, map: &str, options: &[&str]) -> Vec<u8> {
    trace(folder, map, &[&FOR[..], options].concat()).expect("a map");
    folder.bytes(map)
}

#[test]
fn shards_extensions_and_decisions_carry_the_same_variants() {
    let folder = test_folder();
    let whole = traced(&folder, "whole.sonelmap", &["--packets", "1500"]);
    traced(&folder, "one.sonelmap", &["--packets", "1"]);
    let decision = folder.path("one.sonelmap").display().to_string();
    for part in ["1/2", "2/2"] {
        let name = format!("{}.sonelmap", &part[..1]);
        traced(&folder, &name, &["--packets", "1500", "--decision", &decision, "--shard", part]);
    }
    merge(&folder, &["2.sonelmap", "1.sonelmap"], "merged.sonelmap").unwrap();
    traced(&folder, "short.sonelmap", &["--packets", "700"]);
    let short = folder.path("short.sonelmap").display().to_string();
    trace(&folder, "longer.sonelmap", &["--extend", &short, "--packets", "1500"]).unwrap();
    assert!(whole == folder.bytes("longer.sonelmap") && whole == folder.bytes("merged.sonelmap"));
    let rendered = |map: &str| {
        render(&folder, map, "a.npz", &["--rays", "64", "--set", "materials.walls.absorption=0.9"]).unwrap();
        response(&folder, "a.npz").energy
    };
    // The scene file may state the same variants.
    let stated = folder.text("scene.toml").replace(
        "[materials.z0]\n",
        "variants = [{ absorption = [0.1, 0.2, 0.2] }, { absorption = 0.9 }]\n\n[materials.z0]\nvariants = [{ scattering = 0.3 }]\n",
    );
    let other = TestFolder::with(&stated);
    trace(&other, "stated.sonelmap", &["--packets", "1500"]).unwrap();
    render(&other, "stated.sonelmap", "a.npz", &["--rays", "64", "--set", "materials.walls.absorption=0.9"])
        .unwrap();
    assert_eq!(response(&other, "a.npz").energy, rendered("whole.sonelmap"));
    // Other variants are refused.
    let refused = complaint(trace(&folder, "b.sonelmap", &["--decision", &decision]));
    assert!(refused.contains("for other variants"), "{refused}");
    let options = ["--extend", &short, "--packets", "900", "--for", "materials.z0.scattering=0.35"];
    assert!(complaint(trace(&folder, "b.sonelmap", &options)).contains("--for names other variants"));
    trace(&folder, "b.sonelmap", &["--packets", "1500", "--shard", "1/2"]).unwrap();
    let refused = complaint(merge(&folder, &["b.sonelmap", "2.sonelmap"], "c.sonelmap"));
    assert!(refused.contains("variants of material \"walls\" is"), "{refused}");
}

/// The command of the refusal makes the map that answers.
#[test]
fn a_refusal_names_the_command_that_answers() {
    let folder = test_folder();
    folder.write("scene.toml", folder.text("scene.toml").replace("scattering = 0.4", "scattering = 0.0"));
    trace(&folder, "room.sonelmap", &["--packets", "600", "--effects", "auto"]).unwrap();
    let set = ["--set", "materials.walls.scattering=0.3", "--rays", "64"];
    let refused = complaint(render(&folder, "room.sonelmap", "a.npz", &set));
    let (_, command) = refused.split_once("trace the scene for them: ").expect("a command");
    assert_eq!(refused.lines().count(), 1, "{refused}");
    let mut words = command.split(' ').skip_while(|word| *word != "--packets");
    let options: Vec<&str> = words.by_ref().collect();
    assert_eq!(options, ["--packets", "600", "--for", "materials.walls.scattering=0.3"], "{refused}");
    trace(&folder, "room.sonelmap", &options).unwrap();
    render(&folder, "room.sonelmap", "a.npz", &set).unwrap();
    let paper = complaint(trace(&folder, "room.sonelmap", &[&options[..], &["--mode", "paper"]].concat()));
    assert!(paper.contains("leave --for"), "{paper}");
}
