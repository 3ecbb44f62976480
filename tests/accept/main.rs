//! Long runs behind `cargo xtask accept`: what must hold before a release and takes too long for every change.

mod agreement;
mod coverage;
mod losses;
mod uneven_box;

use std::path::Path;

use sonel_scene::{Loaded, Scene};

/// A shipped scene.
pub fn shipped(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name);
    let text = std::fs::read_to_string(folder.join("scene.toml")).expect("a shipped scene");
    let Loaded { scene, .. } =
        sonel_scene::load(&text, name, &mut |mesh| std::fs::read(folder.join(mesh))).expect("a sound scene");
    scene
}
