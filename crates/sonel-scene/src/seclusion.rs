//! Receivers in a closed room that opaque walls seal off from every source.
//!
//! Two walks, from the receiver and from a source, look for each other in every step: along a straight line, past interfaces and walls that
//! transmit in some band. What they find is a way. Where they find none there may be an opening, but one so small that next to no packet
//! passes it.

use glam::DVec3;
use sonel_geometry::{Departure, Geometry, SurfaceId};

use crate::Scene;
use crate::report::Report;
use crate::walk::Walk;

/// Steps of two walks that look for each other.
const STEPS: u32 = 16_384;

/// Warns of each receiver to which no way leads from any source.
pub(crate) fn warn(scene: &Scene, geometry: &Geometry, report: &mut Report<'_>) {
    if !geometry.is_closed_room() || !report.is_clean() {
        return;
    }
    for (index, receiver) in scene.receivers.iter().enumerate() {
        let is_reached = |source: DVec3| {
            is_connected(geometry, [receiver.position, source], |it| passes(scene, geometry, it))
        };
        if !scene.sources.iter().any(|source| is_reached(source.position)) {
            report.warn(format!(
                "receivers[{}].position: {} is sealed off from every source, so no sound arrives; move the receiver, open a wall, or \
                 give a wall transmission or sound_reduction_db",
                index + 1,
                receiver.position
            ));
        }
    }
}

fn passes(scene: &Scene, geometry: &Geometry, surface: SurfaceId) -> bool {
    let surface = geometry.surface(surface);
    let material = scene.materials.get(surface.material as usize);
    surface.interface || material.is_some_and(|it| it.transmission.iter().any(|&share| share > 0.0))
}

/// Whether walks from two world positions [m] find each other, past surfaces that `passes`.
fn is_connected(geometry: &Geometry, places: [DVec3; 2], passes: impl Fn(SurfaceId) -> bool) -> bool {
    let [mut here, mut there] = places.map(|place| Walk::new(geometry, geometry.to_local(place)));
    (0..STEPS).any(|step| {
        let is_way = geometry.reaches(Departure::free(here.at), there.at, &passes).is_some();
        // Out of step, so that they do not go the same ways.
        here.step();
        if step % 2 == 1 {
            there.step();
        }
        is_way
    })
}
