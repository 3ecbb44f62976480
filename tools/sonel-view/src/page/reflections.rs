//! Early reflections as lines in the room.
//!
//! A response lists the direction and the length of an arrival. Its way is followed back from the receiver, mirrored at every surface it meets,
//! and is drawn where it ends at the source after as many reflections. Sound over an edge without reflection bends once: at the point of its
//! direction from which the rest of its length leads to the source. Other arrivals over edges, and what passed partitions, are not drawn.

use glam::DVec3;
use serde::Serialize;
use sonel::drawing::plot::{self, Arrival};
use sonel::echograms::Echograms;
use sonel::geometry::{Departure, Geometry};

/// A way that misses the source by more than this part of its length is another one.
const MISS: f64 = 1e-3;

/// An early reflection in the room.
#[derive(Debug, Serialize)]
pub(crate) struct ReflectionPath {
    /// Number of reflections.
    pub order: u32,
    /// Its entry in the legend.
    pub class: String,
    /// Delay to the direct sound [ms].
    pub delay: f64,
    /// Its part in G [dB].
    pub strength: f64,
    /// Between receiver and source, the nearest to the receiver first [m].
    pub corners: Vec<[f64; 3]>,
}

/// Early reflections of source and receiver that can be followed between `walls`.
pub(super) fn of(response: &Echograms, walls: &Geometry, pair: (usize, usize)) -> Vec<ReflectionPath> {
    let arrivals = plot::arrivals(response, pair, None);
    let last = plot::shown_ms(&arrivals);
    // As exact as a screen and a line on it.
    let rounded = |value: f64, steps: f64| (value * steps).round() / steps;
    let path = |arrival: &Arrival| {
        let corners = corners(response, walls, pair, arrival)?;
        let between = &corners[1..corners.len() - 1];
        Some(ReflectionPath {
            order: arrival.order,
            class: plot::class_name(arrival.order, arrival.over_edge),
            delay: rounded(arrival.delay_ms, 1e4),
            strength: rounded(arrival.strength_db, 1e4),
            corners: between.iter().map(|at| at.to_array().map(|value| rounded(value, 100.0))).collect(),
        })
    };
    arrivals.iter().filter(|arrival| arrival.delay_ms <= last).filter_map(path).collect()
}

fn corners(
    response: &Echograms,
    geometry: &Geometry,
    (s, r): (usize, usize),
    arrival: &Arrival,
) -> Option<Vec<DVec3>> {
    let source = DVec3::from_array(response.source_positions[s]);
    let receiver = DVec3::from_array(response.receiver_positions[r]);
    let direction = DVec3::from_slice(&response.arrivals.direction[3 * arrival.index..]);
    let length = response.arrivals.time_s[arrival.index] * response.speed_of_sound;
    match (arrival.order, arrival.over_edge) {
        (0, true) => bent_once(receiver, source, direction, length),
        (_, true) => None,
        (order, false) => mirrored(geometry, [receiver, source], direction, (order, length)),
    }
}

/// R + s u with s + |R + s u − S| = ℓ.
fn bent_once(receiver: DVec3, source: DVec3, direction: DVec3, length: f64) -> Option<Vec<DVec3>> {
    let back = receiver - source;
    let distance = 0.5 * (length * length - back.length_squared()) / (length + direction.dot(back));
    (distance > 0.0 && distance < length).then(|| vec![receiver, receiver + distance * direction, source])
}

fn mirrored(
    geometry: &Geometry,
    [receiver, source]: [DVec3; 2],
    mut direction: DVec3,
    (order, length): (u32, f64),
) -> Option<Vec<DVec3>> {
    let mut corners = vec![receiver];
    let mut departure = Departure::free(geometry.to_local(receiver));
    let mut gone = 0.0;
    for _ in 0..order {
        let hit = geometry.closest_hit(departure, direction.as_vec3())?;
        let normal = geometry.surface(hit.surface).normal;
        gone += f64::from(hit.distance);
        corners.push(geometry.to_world(hit.position));
        direction -= 2.0 * direction.dot(normal) * normal;
        departure = geometry.leave(hit.position, hit.surface, hit.side);
    }
    let last = corners[corners.len() - 1] + (length - gone) * direction;
    (last.distance(source) <= MISS * length).then(|| {
        corners.push(source);
        corners
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel::geometry::Mesh;

    #[test]
    fn a_reflection_is_followed_to_its_source_and_a_wrong_one_is_not_drawn() {
        let geometry = Geometry::build(Mesh::shoebox([5.0, 4.0, 3.0], [0; 6])).unwrap();
        let (receiver, source) = (DVec3::new(1.0, 1.0, 1.0), DVec3::new(4.0, 1.0, 1.0));
        // Image behind the floor, then one behind floor and the wall x = 5.
        for (image, order, bounce) in [
            (DVec3::new(4.0, 1.0, -1.0), 1, DVec3::new(2.5, 1.0, 0.0)),
            (DVec3::new(6.0, 1.0, -1.0), 2, DVec3::new(3.5, 1.0, 0.0)),
        ] {
            let way = image - receiver;
            let follow =
                |length: f64| mirrored(&geometry, [receiver, source], way.normalize(), (order, length));
            let corners = follow(way.length()).unwrap();
            assert_eq!(corners.len(), order as usize + 2);
            assert!(
                corners[1].distance(bounce) < 1e-4 && corners[order as usize + 1] == source,
                "{corners:?}"
            );
            assert!(follow(way.length() + 0.1).is_none());
        }
    }

    #[test]
    fn sound_over_an_edge_bends_where_its_length_says() {
        let (receiver, edge, source) = (DVec3::ZERO, DVec3::new(3.0, 0.0, 4.0), DVec3::new(6.0, 0.0, 0.0));
        let corners = bent_once(receiver, source, edge.normalize(), 10.0).unwrap();
        assert!(corners.len() == 3 && corners[1].distance(edge) < 1e-12);
        assert!(
            bent_once(receiver, source, edge.normalize(), 5.0).is_none(),
            "shorter than the straight way"
        );
    }
}
