//! A mesh of any bytes, taken for every format, is read or refused with reasons; what is read has walls.
#![no_main]

use libfuzzer_sys::fuzz_target;

const SCENE: &str = "mesh = \"m.obj\"\nduration_s = 1\nmaterials.w.absorption = 0.1\n\
                     sources = [{ position = [0.1, 0.2, 0.3] }]\n";

fuzz_target!(|bytes: &[u8]| {
    for ending in ["obj", "glb", "stl", "ply", "dxf"] {
        let scene = SCENE.replace("m.obj", &format!("m.{ending}"));
        match sonel_scene::load(&scene, "scene.toml", &mut |_| Ok(bytes.to_vec())) {
            Ok(loaded) => assert!(loaded.scene.geometry().is_ok()),
            Err(errors) => assert!(!errors.problems.is_empty()),
        }
    }
});
