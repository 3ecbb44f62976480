//! Scenes changed in ways that must not change what is heard.

use glam::{DQuat, DVec3};
use sonel_acoustics::Directivity;
use sonel_scene::Scene;

/// The first source at the place of `receiver`, and a single receiver where the source was.
#[must_use]
pub fn exchanged(mut scene: Scene, receiver: usize) -> Scene {
    scene.receivers.swap(0, receiver);
    scene.receivers.truncate(1);
    std::mem::swap(&mut scene.sources[0].position, &mut scene.receivers[0].position);
    scene
}

/// Turned about an odd axis and shifted by ten kilometres.
#[must_use]
pub fn moved(mut scene: Scene) -> Scene {
    let turn = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64).normalize(), 0.7);
    let shift = DVec3::new(8_000.0, -5_000.0, 3_300.0);
    let place = |position: &mut DVec3| *position = turn * *position + shift;
    scene.mesh.vertices.iter_mut().for_each(place);
    scene.sources.iter_mut().map(|source| &mut source.position).for_each(place);
    scene.receivers.iter_mut().map(|receiver| &mut receiver.position).for_each(place);
    let aims = scene.sources.iter_mut().map(|source| &mut source.aim);
    for aim in aims.chain(scene.receivers.iter_mut().map(|receiver| &mut receiver.aim)) {
        *aim = turn * *aim;
    }
    for source in &mut scene.sources {
        if let Directivity::Measured { up, .. } = &mut source.directivity {
            *up = turn * *up;
        }
    }
    scene.up = turn * scene.up;
    scene
}
