//! A map extended is the map of the longer run, byte for byte; what contradicts it is refused.

use std::io::Cursor;

use sonel_map::{MapHeader, MapWriter, ShardRange, SonelMap};
use sonel_testkit::workshop::Workshop;
use sonel_tracer::{TracedChunk, Tracer};

use crate::{render, trace, workshop};

/// Two sources, one of them directional.
fn shop() -> Workshop {
    let shop = workshop();
    let scene = shop.text("scene.toml");
    let second = "\n[[sources]]\nname = \"second\"\nposition = [4.0, 3.0, 1.0]\ndirectivity = \"cardioid\"\naim = [0.0, -1.0, 0.0]\n";
    shop.write("scene.toml", scene + second);
    shop
}

fn extend(shop: &Workshop, map: &str, output: &str, options: &[&str]) -> anyhow::Result<String> {
    let map = shop.path(map).display().to_string();
    trace(shop, output, &[&["--extend", &map], options].concat())
}

fn complaint(shop: &Workshop, options: &[&str]) -> String {
    let complaint =
        format!("{:#}", extend(shop, "a.sonelmap", "b.sonelmap", options).expect_err("a contradiction"));
    assert!(!shop.path("b.sonelmap").exists());
    complaint
}

#[test]
fn a_map_extended_is_the_longer_run() {
    let shop = shop();
    for options in [
        &[][..],
        &["--spectral", "per-band", "--batches", "5"],
        &["--mode", "paper"],
        &["--survival", "0", "--duration", "0.25", "--effects", "none", "--seed", "9"],
    ] {
        trace(&shop, "long.sonelmap", &[options, &["--sonels", "1500"]].concat()).unwrap();
        for short in ["30", "512", "1300"] {
            trace(&shop, "short.sonelmap", &[options, &["--sonels", short]].concat()).unwrap();
            // Options may be left out or repeated.
            for repeated in [&[][..], options] {
                let all = [repeated, &["--sonels", "1500"]].concat();
                extend(&shop, "short.sonelmap", "extended.sonelmap", &all).unwrap();
                assert!(
                    shop.bytes("extended.sonelmap") == shop.bytes("long.sonelmap"),
                    "{options:?} from {short}"
                );
            }
        }
    }
}

/// At interfaces packets draw numbers, which a map that is extended does not tell.
#[test]
fn a_map_of_two_airs_extended_is_the_longer_run() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/warm-layer");
    let shop = workshop();
    for file in ["scene.toml", "hall.obj"] {
        shop.write(file, std::fs::read(folder.join(file)).unwrap());
    }
    trace(&shop, "long.sonelmap", &["--sonels", "700"]).unwrap();
    trace(&shop, "short.sonelmap", &["--sonels", "100"]).unwrap();
    extend(&shop, "short.sonelmap", "extended.sonelmap", &["--sonels", "700"]).unwrap();
    assert!(shop.bytes("extended.sonelmap") == shop.bytes("long.sonelmap"));
    let error =
        |options: &[&str]| format!("{:#}", render(&shop, "long.sonelmap", "a.npz", options).unwrap_err());
    assert!(error(&["--temperature", "10"]).contains("several airs"));
    assert!(error(&["--estimator", "paper"]).contains("one air"));
    assert!(error(&["--set", "materials.layer.absorption=0.5"]).contains("interface between airs"));
    // Without refraction the hall has one air and the interface is no more.
    for options in [&["--effects", "auto,-refraction"][..], &["--mode", "paper", "--effects", "none"]] {
        trace(&shop, "one.sonelmap", &[options, &["--sonels", "100"]].concat()).unwrap();
        trace(&shop, "two.sonelmap", &[options, &["--sonels", "200"]].concat()).unwrap();
        extend(&shop, "one.sonelmap", "extended.sonelmap", &["--sonels", "200"]).unwrap();
        assert!(shop.bytes("extended.sonelmap") == shop.bytes("two.sonelmap"));
        let printed = render(&shop, "one.sonelmap", "one.npz", &["--rays", "64", "--json"]).unwrap();
        assert!(!printed.contains("... I S^k R"), "{printed}");
    }
}

#[test]
fn a_map_may_replace_itself_again_and_again() {
    let shop = shop();
    trace(&shop, "long.sonelmap", &["--sonels", "2k"]).unwrap();
    trace(&shop, "a.sonelmap", &["--sonels", "100"]).unwrap();
    for sonels in ["600", "1024", "2000"] {
        extend(&shop, "a.sonelmap", "a.sonelmap", &["--sonels", sonels]).unwrap();
    }
    assert!(shop.bytes("a.sonelmap") == shop.bytes("long.sonelmap"));
}

#[test]
fn contradictions_are_named_with_both_values_all_at_once() {
    let shop = shop();
    trace(&shop, "a.sonelmap", &["--sonels", "700", "--seed", "3"]).unwrap();
    let before = shop.bytes("a.sonelmap");
    for (option, value, traced) in [
        ("--seed", "4", "traced with 3"),
        ("--batches", "5", "traced with 32"),
        ("--survival", "0.5", "traced with 0.15"),
        ("--duration", "0.5", "traced with 0.6"),
        ("--spectral", "per-band", "traced with shared"),
        ("--mode", "paper", "traced with accurate"),
    ] {
        let complaint = complaint(&shop, &["--sonels", "800", option, value]);
        assert!(
            complaint.contains(&format!("{option} {value}")) && complaint.contains(traced),
            "{complaint}"
        );
    }
    let effects = complaint(&shop, &["--sonels", "800", "--effects", "auto,-air"]);
    assert!(effects.contains("air off, off, off") && effects.contains("with on, on, on"), "{effects}");
    for sonels in ["700", "699"] {
        let complaint = complaint(&shop, &["--sonels", sonels]);
        assert!(complaint.contains(&format!("--sonels {sonels}, the map has 700")), "{complaint}");
    }
    let several = complaint(&shop, &["--sonels", "50", "--seed", "4", "--batches", "5"]);
    assert_eq!(several.lines().count(), 3, "{several}");
    assert!(complaint(&shop, &[]).contains("--extend needs --sonels"));
    assert!(complaint(&shop, &["--sonels", "800", "--shard", "1/2"]).contains("--shard a part"));
    assert!(before == shop.bytes("a.sonelmap"));
}

/// The map in `a.sonelmap` as if a program of `version` had traced it.
fn traced_by(shop: &Workshop, version: String) -> Result<(), Box<dyn std::error::Error>> {
    let map = SonelMap::from_bytes(&shop.bytes("a.sonelmap"))?;
    let header = MapHeader { tool_version: version, ..map.header().clone() };
    let geometry = header.scene.geometry()?;
    let mut writer = MapWriter::begin(Cursor::new(Vec::new()))?;
    let sink = |chunk: TracedChunk| {
        writer.push_chunk(chunk.source, chunk.first_emission, &chunk.paths, &chunk.books)
    };
    Tracer::of(&header, &geometry).run(ShardRange::WHOLE, sink)?;
    shop.write("a.sonelmap", writer.finish(&header)?.into_inner());
    Ok(())
}

#[test]
fn a_map_of_another_build_is_extended_and_one_of_another_revision_is_not() {
    let shop = shop();
    trace(&shop, "a.sonelmap", &["--sonels", "700"]).unwrap();
    let version = SonelMap::from_bytes(&shop.bytes("a.sonelmap")).unwrap().header().tool_version.clone();
    let (revision, _) = version.rsplit_once('.').unwrap();
    traced_by(&shop, format!("{revision}9.ab")).unwrap();
    let complaint = complaint(&shop, &["--sonels", "800"]);
    assert!(complaint.contains(&format!("sonel {revision}9.ab traced it, this is {version}")), "{complaint}");
    traced_by(&shop, format!("{revision}.ab")).unwrap();
    extend(&shop, "a.sonelmap", "b.sonelmap", &["--sonels", "800"]).unwrap();
    trace(&shop, "long.sonelmap", &["--sonels", "800"]).unwrap();
    assert!(shop.bytes("b.sonelmap") == shop.bytes("long.sonelmap"));
}

#[test]
fn another_scene_is_not_extended() {
    let shop = shop();
    trace(&shop, "a.sonelmap", &["--sonels", "700"]).unwrap();
    let scene = shop.text("scene.toml");
    shop.write("scene.toml", scene.replace("0.3, 0.4]", "0.3, 0.45]"));
    let complaint = complaint(&shop, &["--sonels", "800"]);
    assert!(complaint.contains("the scene file has digest"), "{complaint}");
}

#[test]
fn shards_damaged_maps_and_other_files_are_not_extended() {
    let shop = shop();
    let options = ["--sonels", "4k"];
    assert!(complaint(&shop, &options).contains("cannot open"));
    shop.write("a.sonelmap", "a letter");
    assert!(complaint(&shop, &options).contains("not a sonel map"));
    std::fs::remove_file(shop.path("a.sonelmap")).unwrap();
    trace(&shop, "a.sonelmap", &["--sonels", "2k", "--shard", "2/2"]).unwrap();
    assert!(complaint(&shop, &options).contains("join all shards first"));
    trace(&shop, "a.sonelmap", &["--sonels", "2k"]).unwrap();
    let mut damaged = shop.bytes("a.sonelmap");
    damaged[9000] ^= 1;
    shop.write("a.sonelmap", damaged);
    assert!(complaint(&shop, &options).contains("damaged at byte"));
}
