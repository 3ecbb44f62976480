//! What is about a receiver: its lateral axis, where it has one, and the nearest surface.

use glam::DVec3;
use sonel_acoustics::Pattern;

use super::Renderer;
use crate::directions::lateral_axis;
use crate::receiver::ReceiverPoint;

impl Renderer<'_> {
    /// Why directions cannot be added up at `receiver`, where they are asked for.
    pub(crate) fn lateral_problem(&self, receiver: &ReceiverPoint) -> Option<String> {
        if !self.prepared.settings.directions {
            return None;
        }
        let name = &receiver.name;
        if receiver.sensitivity.pattern != Pattern::Omni {
            let pattern = receiver.sensitivity.pattern;
            return Some(format!(
                "receiver \"{name}\": lateral energies need an omnidirectional receiver, this one is {pattern}: leave its directivity out"
            ));
        }
        self.lateral_axis(receiver).is_none().then(|| {
            format!(
                "receiver \"{name}\" aims straight up or down, so its lateral axis is undefined: give it an aim with a horizontal part \
                 (NAME=x,y,z,omni,x,y,z)"
            )
        })
    }

    /// The lateral axis of `receiver`: horizontal, at right angles to its aim or, without one, to the direction of the first source.
    #[must_use]
    pub fn lateral_axis(&self, receiver: &ReceiverPoint) -> Option<DVec3> {
        let scene = &self.map.header().scene;
        let to_source =
            scene.sources.first().map_or(DVec3::ZERO, |source| source.position - receiver.position);
        let stated = receiver.sensitivity.aim;
        let aim = if stated.length_squared() > 0.0 { stated } else { to_source };
        lateral_axis(aim, scene.up)
    }

    /// Distance from `receiver` to the nearest surface [m], and its material; the border between two airs has none.
    #[must_use]
    pub fn nearest_surface(&self, receiver: &ReceiverPoint) -> (f64, &str) {
        let (distance, material) = self.geometry.nearest_surface(receiver.position);
        let material = self.map.header().scene.materials.get(material as usize);
        (distance, material.map_or("air", |material| &material.name))
    }
}
