//! What is done before a trace: `new`, `check` and `materials`, and scenes of such names.
#![allow(clippy::unwrap_used, reason = "the functions that tests share are no #[test] themselves")]

use serde_json::Value;
use sonel_testkit::meshes::{self, room};
use sonel_testkit::test_folder::{Ended, TestFolder};

const PROGRAM: &str = env!("CARGO_BIN_EXE_sonel-trace");
const SCENE: &str = "shoebox = [5.0, 4.0, 3.0]\nduration_s = 0.1\n[materials.walls]\nabsorption = 0.5\n\
                     [[sources]]\nposition = [1.0, 1.0, 1.5]\n";

fn trace(folder: &TestFolder, scene: &str, map: &str) -> Ended {
    folder.run(PROGRAM, &[scene, "-o", map, "--packets", "500", "--effects", "none", "--quiet"])
}

#[test]
fn a_new_scene_is_checked_and_traced_and_every_format_gives_the_same_map() {
    let folder = TestFolder::with("");
    let files = meshes::named_files(&room());
    for (name, bytes) in &files {
        folder.write(name, bytes);
    }
    folder.write("room data.bin", meshes::gltf_buffer(&room()));
    let made = folder.run(PROGRAM, &["new", "room.obj", "-o", "first.toml"]);
    assert_eq!((made.code, made.out.as_str()), (Some(0), ""), "{}", made.err);
    let checked = folder.run(PROGRAM, &["check", "first.toml"]);
    assert_eq!(checked.code, Some(0), "{}", checked.out);
    for part in ["210.0 m³", "Sabine [s]", "floor", "no problems found"] {
        assert!(checked.out.contains(part), "{part}: {}", checked.out);
    }
    for (name, _) in &files {
        folder.write("scene.toml", folder.text("first.toml").replace("room.obj", name));
        let traced = trace(&folder, "scene.toml", &format!("{name}.sonelmap"));
        assert_eq!(traced.code, Some(0), "{name}: {}", traced.err);
        assert!(folder.bytes(&format!("{name}.sonelmap")) == folder.bytes("room.obj.sonelmap"), "{name}");
    }
}

#[test]
fn a_classroom_is_made_checked_and_said_to_have_a_target() {
    let folder = TestFolder::with("");
    let words = ["new", "--shoebox", "9,7,3", "--purpose", "classroom", "-o", "room.toml"];
    let made = folder.run(PROGRAM, &words);
    assert_eq!(made.code, Some(0), "{}", made.err);
    assert!(made.err.starts_with("target: T 0.56 s, within 0.45 … 0.67 s"), "{}", made.err);
    let checked = folder.run(PROGRAM, &["check", "room.toml"]);
    assert!(checked.out.contains("189.0 m³"), "{}", checked.out);
    // Defaults are one line, or a line each.
    assert_eq!(checked.out.matches("(default").count(), 0, "{}", checked.out);
    assert!(checked.out.contains("note: defaults: bands octaves 63 … 8000 Hz; air 20 °C"), "{}", checked.out);
    let verbose = folder.run(PROGRAM, &["check", "room.toml", "--verbose"]);
    assert!(verbose.out.matches("(default").count() > 3, "{}", verbose.out);
    for (words, said) in [
        (&["new", "--shoebox", "9,7", "-o", "b.toml"][..], "three lengths"),
        (&["new", "--shoebox", "9,7,-3", "-o", "b.toml"], "shoebox"),
        (&["new", "--shoebox", "9,7,3", "room.obj", "-o", "b.toml"], "cannot be used with"),
        (&["new", "--shoebox", "9,7,3", "--purpose", "sauna", "-o", "b.toml"], "classroom"),
        (&["new", "-o", "b.toml"], "--shoebox"),
        (&["chekc", "room.toml"], "`chekc` is neither a file nor a command; commands: "),
        (&["room.toml", "check"], "the command comes first: sonel-trace check room.toml"),
    ] {
        assert!(folder.run(PROGRAM, words).refused().contains(said), "{words:?}");
    }
}

#[test]
fn a_new_scene_replaces_nothing() {
    let folder = TestFolder::with("edited = 1");
    folder.write("room.obj", meshes::obj(&room()));
    let refused = folder.run(PROGRAM, &["new", "room.obj", "-o", "scene.toml"]).refused();
    assert!(refused.contains("scene.toml"), "{refused}");
    assert_eq!(folder.text("scene.toml"), "edited = 1");
    assert!(folder.run(PROGRAM, &["new", "none.obj", "-o", "other.toml"]).refused().contains("none.obj"));
    assert!(!folder.names().contains(&"other.toml".to_owned()));
}

#[test]
fn a_check_ends_with_code_1_where_something_needs_a_look() {
    let folder = TestFolder::with(SCENE);
    assert_eq!(folder.run(PROGRAM, &["check", "scene.toml"]).code, Some(0));
    folder.write("scene.toml", SCENE.replace("1.5]", "-1.5]"));
    let ended = folder.run(PROGRAM, &["check", "scene.toml"]);
    assert_eq!(ended.code, Some(1));
    assert!(ended.out.contains("error: scene.toml:6:12: sources[1].position"), "{}", ended.out);
    assert!(ended.out.contains("60.0 m³") && ended.out.ends_with("1 problem found\n"), "{}", ended.out);
    let listed = folder.run(PROGRAM, &["check", "scene.toml", "--json"]);
    let json: Value = serde_json::from_str(&listed.out).unwrap();
    assert_eq!((listed.code, json["errors"].as_array().unwrap().len()), (Some(1), 1), "{}", listed.out);
    assert_eq!((json["room"]["triangles"].as_u64(), json["room"]["surfaces"].as_u64()), (Some(12), Some(6)));
    assert!((json["room"]["volume_m3"].as_f64().unwrap() - 60.0).abs() < 1e-9, "{}", listed.out);
    let fixed = folder.run(PROGRAM, &["check", "scene.toml", "--fix", "fixed.obj"]);
    assert_eq!(fixed.code, Some(1), "{}", fixed.err);
    assert_eq!(folder.text("fixed.obj").matches("\nf ").count(), 12);
    assert!(fixed.err.ends_with("wrote fixed.obj, in metres:\n  no repairs were needed\n"), "{}", fixed.err);
    assert!(
        folder
            .run(PROGRAM, &["check", "scene.toml", "--fix", "scene.toml"])
            .refused()
            .contains("is an input")
    );
    folder.write("mine.obj", "v 0 0 0");
    assert!(
        folder
            .run(PROGRAM, &["check", "scene.toml", "--fix", "mine.obj"])
            .refused()
            .contains("mine.obj exists")
    );
    folder.write("scene.toml", "shoebox = [");
    assert_eq!(folder.run(PROGRAM, &["check", "scene.toml"]).code, Some(2));
    assert_eq!(folder.run(PROGRAM, &["check", "none.toml"]).code, Some(2));
}

#[test]
fn materials_are_found_by_their_words() {
    let folder = TestFolder::with(SCENE);
    let found = folder.run(PROGRAM, &["materials", "needle", "FELT"]);
    assert_eq!(found.code, Some(0));
    assert!(found.out.contains("felt-5mm") && found.out.contains("0.02*"), "{}", found.out);
    assert!(found.out.lines().count() == 3, "{}", found.out);
    // Not the outdoor soils that stand before it in the library.
    let doors = folder.run(PROGRAM, &["materials", "door"]).out;
    assert!(doors.lines().nth(1).is_some_and(|line| line.contains("door-wooden")), "{doors}");
    assert!(doors.contains("soil-bare"), "{doors}");
    assert_eq!(folder.run(PROGRAM, &["materials", "unobtainium"]).code, Some(1));
    folder.write("m.geo", "ABS oak = <1 2 3 4 5 6>\n");
    assert!(folder.run(PROGRAM, &["materials", "--file", "m.geo"]).out.contains("oak"));
    folder.write("m.geo", "ABS oak = <1 2 3>\n");
    assert!(folder.run(PROGRAM, &["materials", "--file", "m.geo"]).refused().contains("m.geo:1:1: ABS oak"));
}

#[test]
fn commands_take_the_common_options() {
    let folder = TestFolder::with(SCENE);
    folder.write("room.obj", meshes::obj(&room()));
    let common = ["--quiet", "--threads", "1"];
    for words in [&["check", "scene.toml"][..], &["new", "room.obj", "-o", "n.toml"], &["materials", "felt"]]
    {
        let ended = folder.run(PROGRAM, &[words, &common].concat());
        assert_eq!((ended.code, ended.err.as_str()), (Some(0), ""), "{words:?}");
    }
    assert!(folder.run(PROGRAM, &["materials", "--threads", "0"]).refused().contains("1 … 1024"));
}

#[test]
fn a_target_out_of_reach_comes_with_the_limit_that_ended_the_run() {
    let folder = TestFolder::with(SCENE);
    for (limit, said) in
        [(["--at-most", "1s"], "time limit of --at-most"), (["--packets", "2k"], "see --packets")]
    {
        let words = ["scene.toml", "-o", "a.sonelmap", "--until", "level<0.0001dB"];
        let ended = folder.run(PROGRAM, &[&words[..], &limit].concat());
        assert_eq!(ended.code, Some(1), "{ended:?}");
        let line = ended.err.lines().find(|line| line.starts_with("NOT reached")).unwrap();
        assert!(line.contains(said), "{line}");
    }
}

#[test]
fn scenes_may_have_the_names_of_commands() {
    let folder = TestFolder::with(SCENE);
    for name in ["check.toml", "new.toml", "materials.toml", "check"] {
        folder.write(name, SCENE);
        let scene = if name == "check" { "./check" } else { name };
        let map = format!("{}.sonelmap", name.replace('.', "-"));
        assert_eq!(trace(&folder, scene, &map).code, Some(0), "{name}");
    }
    assert!(trace(&folder, "help", "help.sonelmap").refused().contains("help"));
}
