//! Scenes in other air.

use glam::DVec3;
use sonel_acoustics::{Air, Material};
use sonel_geometry::{FaceKind, Geometry};
use sonel_scene::media::MediaFault;
use sonel_scene::{Media, Region, Scene};

/// `scene` with other air, its speed of sound and its attenuation.
#[must_use]
pub fn with_air(mut scene: Scene, air: Air) -> Scene {
    let at = |band: usize| air.energy_attenuation(scene.bands.exact_midband(band));
    scene.air_attenuation = (0..scene.bands.count()).map(at).collect();
    scene.speed_of_sound = air.speed_of_sound();
    scene.air = air;
    scene
}

/// `scene` with `regions`, bounded by the faces of the materials `interfaces`, which become opaque to what knows of walls only. Sources must be
/// there before.
///
/// # Errors
/// Everything that is wrong with regions and interfaces.
///
/// # Panics
/// When the mesh has no usable triangle.
pub fn with_regions(
    mut scene: Scene,
    regions: Vec<Region>,
    interfaces: Vec<u32>,
) -> Result<Scene, Vec<MediaFault>> {
    for &interface in &interfaces {
        let material = &mut scene.materials[interface as usize];
        *material = Material::uniform(&material.name, 1.0, 0.0, scene.bands.count());
    }
    let kind = |material: u32| match scene.materials.get(material as usize) {
        _ if interfaces.contains(&material) => FaceKind::Interface,
        Some(found) if found.transmits() => FaceKind::Partition,
        _ => FaceKind::Wall,
    };
    let geometry =
        Geometry::with_kinds(scene.mesh.clone(), kind, &scene.air_at).expect("the mesh has triangles");
    let sources: Vec<DVec3> = scene.sources.iter().map(|source| source.position).collect();
    scene.media = Some(Media::find(&geometry, regions, interfaces, &sources)?);
    Ok(scene)
}
