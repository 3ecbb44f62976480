//! A scene file of any text is read or refused with reasons; what is read has walls.
#![no_main]

use libfuzzer_sys::fuzz_target;

const MESH: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl w\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

fuzz_target!(|text: &str| {
    match sonel_scene::load(text, "scene.toml", &mut |_| Ok(MESH.to_vec())) {
        Ok(loaded) => assert!(loaded.scene.geometry().is_ok() && loaded.scene.duration > 0.0),
        Err(errors) => assert!(!errors.problems.is_empty()),
    }
});
