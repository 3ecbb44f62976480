//! Damaged files are refused with problems, never with a panic.

use std::fs;
use std::path::Path;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use sonel_scene::{Loaded, SceneErrors, load};

const SCENE: &str = "mesh = \"m.obj\"\nduration_s = 1\nmaterials.w.absorption = 0.1\n\
                     sources = [{ position = [0.1, 0.2, 0.3] }]\n";

fn load_mesh(bytes: &[u8]) -> Result<Loaded, SceneErrors> {
    load(SCENE, "scene.toml", &mut |_| Ok(bytes.to_vec()))
}

fn corpus(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/good").join(name);
    fs::read_to_string(path).unwrap()
}

/// Whatever is refused is refused with a reason, and whatever is read can be used.
fn is_consistent(result: &Result<Loaded, SceneErrors>) -> bool {
    match result {
        Ok(loaded) => {
            let scene = &loaded.scene;
            let lists_fit = scene.materials.iter().all(|m| m.problems(scene.bands.count()).is_empty());
            lists_fit && scene.duration > 0.0 && scene.geometry().is_ok() && !scene.sources.is_empty()
        }
        Err(errors) => !errors.problems.is_empty(),
    }
}

/// Words that an OBJ file may hold.
fn obj_word() -> impl Strategy<Value = String> {
    prop_oneof![
        6 => "[0-9]{1,2}",
        4 => "-?[0-9](\\.[0-9])?(e-?[0-9]{1,3})?",
        4 => Just("\nf ".to_owned()),
        4 => Just("\nv ".to_owned()),
        1 => Just("\nusemtl w\n".to_owned()),
        1 => "[/#\\\\ a-z-]{1,3}",
    ]
}

/// Words that a scene file may hold.
fn toml_word() -> impl Strategy<Value = String> {
    prop_oneof![
        "-?[0-9]{1,3}(\\.[0-9])?",
        "[\\[\\]{}=,.\"\n]{1,2}",
        Just("nan".to_owned()),
        Just("-inf".to_owned()),
        Just("1e308".to_owned()),
        Just("\"walls\"".to_owned()),
        Just("absorption".to_owned()),
        Just("position".to_owned()),
        any::<String>(),
    ]
}

/// Words that a material file may hold.
fn material_word() -> impl Strategy<Value = String> {
    prop_oneof![
        4 => Just("\nABS a = <1 2 3 4 5 6>".to_owned()),
        2 => Just("\n7\tseven\n\t0 .1 .2 .3 .4 .5 .6 .7\n".to_owned()),
        2 => Just("{\"center_freqs\":[125,250],\"absorption\":{\"g\":{\"m\":{\"coeffs\":[0.1]}}}}".to_owned()),
        2 => "[0-9]{1,2} ",
        2 => "[<>{}=;L\n\t\" ]{1,3}",
        1 => "\nABS [a-z]{1,2} = ",
        1 => any::<String>(),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 512, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn any_text_as_scene(text in any::<String>()) {
        prop_assert!(is_consistent(&load(&text, "scene.toml", &mut |_| Ok(Vec::new()))));
    }

    #[test]
    fn scene_with_a_part_replaced(from in 0.0..1.0, length in 0usize..12, word in toml_word()) {
        let text = corpus("every-key.toml");
        let boundary = |mut at: usize| {
            while !text.is_char_boundary(at) { at -= 1; }
            at
        };
        let start = boundary((from * text.len() as f64) as usize);
        let end = boundary((start + length).min(text.len()));
        let damaged = format!("{}{word}{}", &text[..start], &text[end..]);
        let mesh = corpus("every-key.obj").into_bytes();
        prop_assert!(is_consistent(&load(&damaged, "scene.toml", &mut |_| Ok(mesh.clone()))));
    }

    #[test]
    fn material_files_of_any_text(
        words in prop::collection::vec(material_word(), 0..40),
        ending in prop_oneof![Just("txt"), Just("Li8"), Just("json")],
    ) {
        match sonel_scene::library::read_file(&format!("m.{ending}"), words.concat().as_bytes()) {
            Ok(entries) => {
                let lists = entries.iter().flat_map(|entry| entry.absorption.iter().chain(&entry.scattering));
                for octaves in lists {
                    prop_assert!([16.0, 1000.0, 16e3].iter().all(|hz| octaves.at(*hz).0 >= 0.0));
                }
            }
            Err(errors) => prop_assert!(!errors.problems.is_empty()),
        }
    }

    #[test]
    fn any_bytes_as_mesh(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(is_consistent(&load_mesh(&bytes)));
    }

    #[test]
    fn obj_words_as_mesh(words in prop::collection::vec(obj_word(), 0..60)) {
        prop_assert!(is_consistent(&load_mesh(words.join(" ").as_bytes())));
    }

    #[test]
    fn polygons_with_random_corners(
        corners in prop::collection::vec((0i8..6, 0i8..6), 3..14),
        order in Just((1..=14usize).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        let count = corners.len();
        let vertices: String = corners.iter().map(|(x, y)| format!("v {x} {y} 0\n")).collect();
        let face: String = order.iter().filter(|i| **i <= count).map(|i| format!(" {i}")).collect();
        let obj = format!("{vertices}usemtl w\nf{face}\n");
        prop_assert!(is_consistent(&load_mesh(obj.as_bytes())));
    }
}

#[test]
fn deep_nesting_is_refused() {
    let text = format!("a = {}", "[".repeat(100_000));
    assert!(load(&text, "scene.toml", &mut |_| Ok(Vec::new())).is_err());
}

#[test]
fn a_mesh_of_problems_is_summed_up() {
    let obj = "v 0 0\n".repeat(1000);
    let errors = load_mesh(obj.as_bytes()).unwrap_err();
    assert_eq!(errors.problems.len(), 51);
    assert_eq!(errors.problems[50].to_string(), "m.obj:1000:1: and 951 more problems up to this line");
}
