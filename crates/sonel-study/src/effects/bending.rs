//! Bending of packets: on where it is asked for.
//!
//! It keeps bands apart that would share paths, and what it is worth in a scene is not estimated yet, so `auto` and `all` leave it out. The
//! paper's mode has edges of its own.

use sonel_geometry::Geometry;
use sonel_map::Mode;
use sonel_map::edges::{REACH_WAVELENGTHS, bending_edges};
use sonel_scene::Scene;

use super::spec::Wish;
use super::{ASKED, Bound, Decision, Effect};

/// Decides on bending.
pub(super) fn decide(wish: Wish, mode: Mode, scene: &Scene, geometry: &Geometry) -> Decision {
    let bands = scene.bands.count();
    let count = bending_edges(geometry).lines().len();
    let (on, reason) = match wish {
        _ if count == 0 => (false, "no edge is sharp enough".to_owned()),
        Wish::Off => (false, ASKED.to_owned()),
        Wish::Auto | Wish::Scene => (false, "left out unless asked for with +bending".to_owned()),
        Wish::On if mode == Mode::Paper => (false, "the paper bends nothing".to_owned()),
        Wish::On => {
            (true, format!("{ASKED}, {count} edges, up to {REACH_WAVELENGTHS} wavelengths from them"))
        }
    };
    let bound = (count == 0).then(|| Bound::nothing(bands));
    let cost = if on {
        "a segment up to twice, and paths of their own for the bands".to_owned()
    } else {
        String::new()
    };
    Decision { bound, cost, ..Decision::new(Effect::Bending, vec![on; bands], reason) }
}
