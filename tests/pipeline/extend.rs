//! A map extended is the map of the longer run, byte for byte; what contradicts it is refused.

use std::io::Cursor;

use sonel_map::{MapHeader, MapWriter, ShardRange, SonelMap};
use sonel_testkit::test_folder::TestFolder;
use sonel_tracer::{TracedChunk, Tracer};

use crate::{render, test_folder, trace};

/// Two sources, one of them directional.
fn folder() -> TestFolder {
    let folder = test_folder();
    let scene = folder.text("scene.toml");
    let second = "\n[[sources]]\nname = \"second\"\nposition = [4.0, 3.0, 1.0]\ndirectivity = \"cardioid\"\naim = [0.0, -1.0, 0.0]\n";
    folder.write("scene.toml", scene + second);
    folder
}

fn extend(folder: &TestFolder, map: &str, output: &str, options: &[&str]) -> anyhow::Result<String> {
    let map = folder.path(map).display().to_string();
    trace(folder, output, &[&["--extend", &map], options].concat())
}

fn complaint(folder: &TestFolder, options: &[&str]) -> String {
    let complaint =
        format!("{:#}", extend(folder, "a.sonelmap", "b.sonelmap", options).expect_err("a contradiction"));
    assert!(!folder.path("b.sonelmap").exists());
    complaint
}

#[test]
fn a_map_extended_is_the_longer_run() {
    let folder = folder();
    for options in [
        &[][..],
        &["--spectral", "per-band", "--batches", "5"],
        &["--mode", "paper"],
        &["--survival", "0", "--duration", "0.25", "--effects", "none", "--seed", "9"],
    ] {
        trace(&folder, "long.sonelmap", &[options, &["--packets", "1500"]].concat()).unwrap();
        for short in ["30", "512", "1300"] {
            trace(&folder, "short.sonelmap", &[options, &["--packets", short]].concat()).unwrap();
            // Options may be left out or repeated.
            for repeated in [&[][..], options] {
                let all = [repeated, &["--packets", "1500"]].concat();
                extend(&folder, "short.sonelmap", "extended.sonelmap", &all).unwrap();
                assert!(
                    folder.bytes("extended.sonelmap") == folder.bytes("long.sonelmap"),
                    "{options:?} from {short}"
                );
            }
        }
    }
}

/// At interfaces packets draw numbers, which a map that is extended does not tell.
#[test]
fn a_map_of_two_airs_extended_is_the_longer_run() {
    let scene = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/warm-layer");
    let folder = test_folder();
    for file in ["scene.toml", "hall.obj"] {
        folder.write(file, std::fs::read(scene.join(file)).unwrap());
    }
    trace(&folder, "long.sonelmap", &["--packets", "700"]).unwrap();
    trace(&folder, "short.sonelmap", &["--packets", "100"]).unwrap();
    extend(&folder, "short.sonelmap", "extended.sonelmap", &["--packets", "700"]).unwrap();
    assert!(folder.bytes("extended.sonelmap") == folder.bytes("long.sonelmap"));
    let error =
        |options: &[&str]| format!("{:#}", render(&folder, "long.sonelmap", "a.npz", options).unwrap_err());
    assert!(error(&["--temperature", "10"]).contains("several regions of air"));
    assert!(error(&["--estimator", "paper"]).contains("one air"));
    assert!(error(&["--set", "materials.layer.absorption=0.5"]).contains("interface between regions"));
    // Without refraction the hall has one air and the interface is no more.
    for options in [&["--effects", "auto,-refraction"][..], &["--mode", "paper", "--effects", "none"]] {
        trace(&folder, "one.sonelmap", &[options, &["--packets", "100"]].concat()).unwrap();
        trace(&folder, "two.sonelmap", &[options, &["--packets", "200"]].concat()).unwrap();
        extend(&folder, "one.sonelmap", "extended.sonelmap", &["--packets", "200"]).unwrap();
        assert!(folder.bytes("extended.sonelmap") == folder.bytes("two.sonelmap"));
        let printed = render(&folder, "one.sonelmap", "one.npz", &["--rays", "64", "--json"]).unwrap();
        assert!(!printed.contains("... I S^k R"), "{printed}");
    }
}

#[test]
fn a_map_may_replace_itself_again_and_again() {
    let folder = folder();
    trace(&folder, "long.sonelmap", &["--packets", "2k"]).unwrap();
    trace(&folder, "a.sonelmap", &["--packets", "100"]).unwrap();
    for packets in ["600", "1024", "2000"] {
        extend(&folder, "a.sonelmap", "a.sonelmap", &["--packets", packets]).unwrap();
    }
    assert!(folder.bytes("a.sonelmap") == folder.bytes("long.sonelmap"));
}

#[test]
fn contradictions_are_named_with_both_values_all_at_once() {
    let folder = folder();
    trace(&folder, "a.sonelmap", &["--packets", "700", "--seed", "3"]).unwrap();
    let before = folder.bytes("a.sonelmap");
    for (option, value, traced) in [
        ("--seed", "4", "traced with 3"),
        ("--batches", "5", "traced with 32"),
        ("--survival", "0.5", "traced with 0.15"),
        ("--duration", "0.5", "traced with 0.6"),
        ("--spectral", "per-band", "traced with shared"),
        ("--mode", "paper", "traced with accurate"),
    ] {
        let complaint = complaint(&folder, &["--packets", "800", option, value]);
        assert!(
            complaint.contains(&format!("{option} {value}")) && complaint.contains(traced),
            "{complaint}"
        );
    }
    let effects = complaint(&folder, &["--packets", "800", "--effects", "auto,-air"]);
    assert!(effects.contains("air off, off, off") && effects.contains("with on, on, on"), "{effects}");
    for packets in ["700", "699"] {
        let complaint = complaint(&folder, &["--packets", packets]);
        assert!(
            complaint.contains(&format!("--packets {packets} is not above the 700 of the map")),
            "{complaint}"
        );
    }
    let several = complaint(&folder, &["--packets", "50", "--seed", "4", "--batches", "5"]);
    assert_eq!(several.lines().count(), 3, "{several}");
    assert!(complaint(&folder, &[]).contains("--extend needs --packets"));
    assert!(
        complaint(&folder, &["--packets", "800", "--shard", "1/2"])
            .contains("--extend and --shard cannot be combined")
    );
    assert!(before == folder.bytes("a.sonelmap"));
}

/// The map in `a.sonelmap` as if a program of `version` had traced it.
fn traced_by(folder: &TestFolder, version: String) -> Result<(), Box<dyn std::error::Error>> {
    let map = SonelMap::from_bytes(&folder.bytes("a.sonelmap"))?;
    let header = MapHeader { tool_version: version, ..map.header().clone() };
    let geometry = header.scene.geometry()?;
    let mut writer = MapWriter::begin(Cursor::new(Vec::new()))?;
    let sink = |chunk: TracedChunk| {
        let pushed = writer.push_chunk(chunk.source, chunk.first_emission, &chunk.paths, &chunk.ledger);
        pushed.map_err(sonel::Error::from)
    };
    Tracer::of(&header, &geometry).run(ShardRange::WHOLE, sink)?;
    folder.write("a.sonelmap", writer.finish(&header, &geometry)?.into_inner());
    Ok(())
}

#[test]
fn a_map_of_another_build_is_extended_and_one_of_another_revision_is_not() {
    let folder = folder();
    trace(&folder, "a.sonelmap", &["--packets", "700"]).unwrap();
    let version = SonelMap::from_bytes(&folder.bytes("a.sonelmap")).unwrap().header().tool_version.clone();
    let (revision, _) = version.rsplit_once('.').unwrap();
    traced_by(&folder, format!("{revision}9.ab")).unwrap();
    let complaint = complaint(&folder, &["--packets", "800"]);
    assert!(complaint.contains(&format!("sonel {revision}9.ab traced it, this is {version}")), "{complaint}");
    traced_by(&folder, format!("{revision}.ab")).unwrap();
    extend(&folder, "a.sonelmap", "b.sonelmap", &["--packets", "800"]).unwrap();
    trace(&folder, "long.sonelmap", &["--packets", "800"]).unwrap();
    assert!(folder.bytes("b.sonelmap") == folder.bytes("long.sonelmap"));
}

#[test]
fn another_scene_is_not_extended() {
    let folder = folder();
    trace(&folder, "a.sonelmap", &["--packets", "700"]).unwrap();
    let scene = folder.text("scene.toml");
    folder.write("scene.toml", scene.replace("0.3, 0.4]", "0.3, 0.45]"));
    let complaint = complaint(&folder, &["--packets", "800"]);
    assert!(complaint.contains("the scene file has digest"), "{complaint}");
}

#[test]
fn shards_damaged_maps_and_other_files_are_not_extended() {
    let folder = folder();
    let options = ["--packets", "4k"];
    assert!(complaint(&folder, &options).contains("cannot read the map"));
    folder.write("a.sonelmap", "a letter");
    assert!(complaint(&folder, &options).contains("not a sonel map"));
    std::fs::remove_file(folder.path("a.sonelmap")).unwrap();
    trace(&folder, "a.sonelmap", &["--packets", "2k", "--shard", "2/2"]).unwrap();
    assert!(complaint(&folder, &options).contains("join all shards first"));
    trace(&folder, "a.sonelmap", &["--packets", "2k"]).unwrap();
    let mut damaged = folder.bytes("a.sonelmap");
    damaged[9000] ^= 1;
    folder.write("a.sonelmap", damaged);
    assert!(complaint(&folder, &options).contains("damaged at byte"));
}
