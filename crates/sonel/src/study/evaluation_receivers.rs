//! Evaluation receivers: those of the scene, or one point mid-room.
//!
//! The point is that of a regular grid over the room's bounds, within it, which is farthest from every surface and source: errors there
//! are those of most of the room (docs/physics.md §7, κ).

use glam::DVec3;
use sonel_geometry::Geometry;
use sonel_renderer::ReceiverPoint;
use sonel_scene::Scene;

use crate::study::response::receivers_of;

/// Points of the grid along an axis. Chosen, not measured: an odd number, whose middle is mid-room.
const STEPS: u32 = 9;
/// Name of the receiver in every output.
const NAME: &str = "mid-room";

/// Most receivers of a target. Chosen, not measured: each costs as much as the first.
pub const MOST: usize = 16;
/// Receivers of a pilot. Chosen, not measured: doubled, the choice of a number of packets costs up to twice as much.
pub const FEW: usize = 2;

/// The receivers at which the accuracy of a run is read in `scene`, whose walls are `geometry`: those it names or, of more than `most`, some from
/// first to last.
#[must_use]
pub fn evaluation_receivers(scene: &Scene, geometry: &Geometry, most: usize) -> Vec<ReceiverPoint> {
    if scene.receivers.is_empty() {
        return vec![mid_room(scene, geometry)];
    }
    some_of(receivers_of(scene), most)
}

/// At most `most` of `receivers`, at least two, from first to last.
#[must_use]
pub fn some_of(receivers: Vec<ReceiverPoint>, most: usize) -> Vec<ReceiverPoint> {
    let count = receivers.len();
    if count <= most {
        return receivers;
    }
    (0..most).map(|index| receivers[index * (count - 1) / (most - 1)].clone()).collect()
}

fn mid_room(scene: &Scene, geometry: &Geometry) -> ReceiverPoint {
    let (low, high) = geometry.bounds();
    let along = |index: u32| f64::from(index + 1) / f64::from(STEPS + 1);
    let sources: Vec<DVec3> = scene.sources.iter().map(|source| source.position).collect();
    let clearance = |point: DVec3| {
        let distances = sources.iter().map(|source| source.distance(point));
        distances.fold(geometry.distance_to_nearest_surface(point), f64::min)
    };
    let mut best = (f64::NEG_INFINITY, 0.5 * (low + high));
    for index in 0..STEPS.pow(3) {
        let at = DVec3::new(along(index % STEPS), along(index / STEPS % STEPS), along(index / STEPS / STEPS));
        let point = low + at * (high - low);
        if geometry.obstacle(point, &sources).is_some() {
            continue;
        }
        let clearance = clearance(point);
        if clearance > best.0 {
            best = (clearance, point);
        }
    }
    ReceiverPoint::omni(NAME, best.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{Bands, Material};

    fn scene() -> Scene {
        let bands = Bands::octaves();
        Scene::shoebox([10.0, 7.0, 3.0], Material::uniform("walls", 0.2, 0.5, bands.count()), bands)
            .with_source("source", [2.0, 2.0, 1.5])
    }

    #[test]
    fn a_room_without_receivers_is_evaluated_in_its_middle() {
        let scene = scene();
        let geometry = scene.geometry().unwrap();
        let [place] = &evaluation_receivers(&scene, &geometry, MOST)[..] else { panic!("one receiver") };
        assert!(geometry.contains(place.position));
        assert!((place.position.z - 1.5).abs() < 1e-6, "{place:?}");
        assert!(geometry.distance_to_nearest_surface(place.position) > 1.4, "{place:?}");
        assert!(place.position.distance(scene.sources[0].position) > 1.4, "{place:?}");
    }

    #[test]
    fn receivers_of_the_scene_come_first() {
        let scene = scene().with_receiver("seat", [7.0, 5.0, 1.2]);
        let geometry = scene.geometry().unwrap();
        assert_eq!(evaluation_receivers(&scene, &geometry, MOST)[0].name, "seat");
    }
}
