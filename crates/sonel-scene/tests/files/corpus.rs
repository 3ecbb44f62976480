//! Scene files that must be refused with exactly the messages beside them, and scene files that must be read.

use std::fs;
use std::path::{Path, PathBuf};

use sonel_scene::{Loaded, SceneErrors, load};

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name)
}

/// Every scene file of a folder of the corpus, by name.
fn scenes(name: &str) -> Vec<PathBuf> {
    let files = fs::read_dir(folder(name)).unwrap().map(|file| file.unwrap().path());
    let mut scenes: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    scenes.sort();
    scenes
}

fn load_file(path: &Path) -> Result<Loaded, SceneErrors> {
    let text = fs::read_to_string(path).unwrap();
    load(&text, "scene.toml", &mut |mesh| fs::read(path.with_file_name(mesh)))
}

#[test]
fn bad_scenes_are_refused_with_every_problem() {
    let scenes = scenes("bad");
    assert!(scenes.len() >= 10, "the corpus is not where it should be");
    for path in scenes {
        let found = load_file(&path).expect_err(&path.display().to_string()).to_string();
        let expected = fs::read_to_string(path.with_extension("expected")).unwrap_or_default();
        assert_eq!(found.trim_end(), expected.trim_end(), "{}\n{found}", path.display());
    }
}

#[test]
fn good_scenes_are_read_with_their_notes() {
    let scenes = scenes("good");
    assert!(scenes.len() >= 3, "the corpus is not where it should be");
    for path in scenes {
        let loaded = load_file(&path).unwrap_or_else(|errors| panic!("{}\n{errors}", path.display()));
        let warnings = loaded.warnings.into_iter().map(|warning| format!("warning: {warning}"));
        let notes = loaded.notes.into_iter().chain(warnings).collect::<Vec<_>>().join("\n");
        let expected = fs::read_to_string(path.with_extension("expected")).unwrap_or_default();
        assert_eq!(notes.trim_end(), expected.trim_end(), "{}\n{notes}", path.display());
    }
}

/// What is shipped was drawn without cracks: the weld tolerance changes none of it, and none of its edges is taken for a crack.
#[test]
fn shipped_scenes_have_no_cracks() {
    let folders = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let scenes: Vec<PathBuf> = fs::read_dir(folders)
        .unwrap()
        .map(|folder| folder.unwrap().path().join("scene.toml"))
        .filter(|path| path.exists())
        .collect();
    assert!(scenes.len() >= 3, "the scenes are not where they should be");
    for path in scenes {
        let loaded = load_file(&path).unwrap();
        let cracks: Vec<&String> = loaded.notes.iter().filter(|note| note.contains("crack")).collect();
        assert!(cracks.is_empty(), "{}: {cracks:?}", path.display());
    }
}
