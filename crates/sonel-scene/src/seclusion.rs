//! Receivers in a closed room that opaque walls seal off from every source.

use sonel_acoustics::Material;
use sonel_geometry::{Geometry, Surface};

use crate::Scene;
use crate::report::Report;

/// Warns of each receiver in a region of air to which no way leads from any source, past interfaces and walls that transmit in some band.
pub(crate) fn warn(scene: &Scene, geometry: &Geometry, report: &Report) {
    if !geometry.is_closed_room() || !report.is_clean() {
        return;
    }
    let regions = geometry.regions(|surface| passes(scene, surface));
    let of_sources: Vec<u32> = scene.sources.iter().map(|source| regions.at(source.position)).collect();
    for (index, receiver) in scene.receivers.iter().enumerate() {
        if !of_sources.contains(&regions.at(receiver.position)) {
            report.warn(format!(
                "receivers[{}].position: {} is sealed off from every source, so no sound arrives; move the receiver, open a wall, or \
                 give a wall transmission or sound_reduction_db",
                index + 1,
                receiver.position
            ));
        }
    }
}

fn passes(scene: &Scene, surface: &Surface) -> bool {
    let material = scene.materials.get(surface.material as usize);
    surface.interface || material.is_some_and(Material::transmits)
}
