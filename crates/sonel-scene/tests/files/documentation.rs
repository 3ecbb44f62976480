//! The examples of docs/formats/scene.md are scenes.

use std::fs;
use std::path::Path;

use sonel_scene::load;

/// Blocks of a page fenced as TOML.
fn toml_blocks(page: &str) -> Vec<&str> {
    page.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect()
}

#[test]
fn examples_of_the_page_are_read() {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(crate_folder.join("../../docs/formats/scene.md")).unwrap();
    let blocks = toml_blocks(&page);
    assert_eq!(blocks.len(), 2, "the page has a smallest scene and one with every key");
    for block in blocks {
        let mesh = crate_folder.join("tests/corpus/good/every-key.obj");
        let loaded = load(block, "scene.md", &mut |name| beside(name, &mesh));
        assert!(loaded.is_ok(), "{}", loaded.unwrap_err());
    }
}

#[test]
fn the_example_with_every_key_takes_no_default() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats/scene.md"))
        .unwrap();
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/good/every-key.obj");
    let loaded = load(toml_blocks(&page)[1], "scene.md", &mut |name| beside(name, &mesh)).unwrap();
    let defaults: Vec<_> = loaded.notes.iter().filter(|note| note.contains("default")).collect();
    assert!(defaults.is_empty(), "{defaults:?}");
}

/// The files that the page names: `mesh`, a directivity, and a material file.
fn beside(name: &str, mesh: &Path) -> std::io::Result<Vec<u8>> {
    let table = b"azimuth_deg,polar_deg,125,500,2000\n0,0,0,0,0\n0,90,-1,-6,-12\n0,180,-2,-12,-20\n";
    let materials = br#"{"center_freqs": [125, 250, 500, 1000, 2000],
        "absorption": {"Wood": {"door": {"description": "a door", "coeffs": [0.1, 0.1, 0.1, 0.1, 0.1]}}}}"#;
    match Path::new(name).extension().and_then(|ending| ending.to_str()) {
        Some("csv") => Ok(table.to_vec()),
        Some("json") => Ok(materials.to_vec()),
        _ => fs::read(mesh),
    }
}
