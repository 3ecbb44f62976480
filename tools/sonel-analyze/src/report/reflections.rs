//! Early reflections as lines in the room.
//!
//! A response lists the direction and the length of an arrival. Its way is followed back from the receiver, mirrored at every surface it meets,
//! and is drawn where it ends at the source after as many reflections. Sound over an edge without reflection bends once: at the point of its
//! direction from which the rest of its length leads to the source. Other arrivals over edges, and what passed partitions, are not drawn.

use std::collections::BTreeMap;

use glam::DVec3;
use serde_json::{Value, json};
use sonel_drawing::plot::{self, Arrival};
use sonel_echogram::Response;
use sonel_geometry::{Departure, Geometry};

use super::charts::{color, rounded};
use super::page::escaped;
use super::{Subject, Traced, sections};

/// A way that misses the source by more than this part of its length is another one.
const MISS: f64 = 1e-3;
/// Borders of the classes of delay [ms].
const DELAYS_MS: [f64; 5] = [5.0, 20.0, 50.0, 80.0, f64::INFINITY];

/// Classes of lines shown from the start: all of them hide the room.
const SHOWN: usize = 3;

/// An arrival and the corners of its way, the receiver first.
struct Way {
    arrival: Arrival,
    corners: Vec<DVec3>,
}

/// Lines of every pair that was rendered from `map`, by number of reflections and by delay, and none.
pub fn sets(subjects: &[Subject], map: &Traced) -> Vec<(String, Vec<Value>)> {
    let mut sets = Vec::new();
    for (name, subject, index) in sections::drawn(subjects) {
        if subject.response.metadata["map_digest"] != map.json["digest"] {
            continue;
        }
        let receivers = subject.response.receivers();
        let ways = ways(&subject.response, &map.walked.geometry, (index / receivers, index % receivers));
        let by_order = |way: &Way| {
            let Arrival { order, over_edge, .. } = way.arrival;
            ((order, over_edge), plot::class_name(order, over_edge))
        };
        sets.push((format!("{name}, by number of reflections"), traces(&ways, by_order)));
        sets.push((format!("{name}, by delay"), traces(&ways, by_delay)));
    }
    sets.push(("no reflections".to_owned(), Vec::new()));
    sets
}

fn by_delay(way: &Way) -> (usize, String) {
    let class = DELAYS_MS.iter().position(|border| way.arrival.delay_ms < *border).unwrap_or(DELAYS_MS.len());
    let from = class.checked_sub(1).map_or(0.0, |before| DELAYS_MS[before]);
    let name = match DELAYS_MS.get(class) {
        Some(to) if to.is_finite() => format!("{from} to {to} ms"),
        _ => format!("after {from} ms"),
    };
    (class, name)
}

fn ways(response: &Response, geometry: &Geometry, pair: (usize, usize)) -> Vec<Way> {
    let arrivals = plot::arrivals(response, pair, None);
    let last = plot::shown_ms(&arrivals);
    let early = arrivals.into_iter().filter(|arrival| arrival.delay_ms <= last);
    early
        .filter_map(|arrival| Some(Way { corners: corners(response, geometry, pair, &arrival)?, arrival }))
        .collect()
}

fn corners(
    response: &Response,
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

/// Lines of one class are one trace, divided by gaps.
fn traces<K: Ord>(ways: &[Way], class_of: impl Fn(&Way) -> (K, String)) -> Vec<Value> {
    let mut classes: BTreeMap<K, (String, Vec<&Way>)> = BTreeMap::new();
    for way in ways {
        let (class, name) = class_of(way);
        classes.entry(class).or_insert_with(|| (name, Vec::new())).1.push(way);
    }
    classes.into_values().enumerate().map(|(index, (name, ways))| trace(index, &name, &ways)).collect()
}

fn trace(index: usize, name: &str, ways: &[&Way]) -> Value {
    let (mut axes, mut texts) = ([vec![], vec![], vec![]], vec![]);
    for way in ways {
        let Arrival { order, over_edge, delay_ms, strength_db, .. } = way.arrival;
        let text = format!("{}: {delay_ms:.1} ms, {strength_db:.1} dB", plot::class_name(order, over_edge));
        for corner in &way.corners {
            axes.iter_mut().zip(corner.to_array()).for_each(|(axis, value)| axis.push(rounded(value)));
            texts.push(json!(text));
        }
        axes.iter_mut().for_each(|axis| axis.push(Value::Null));
        texts.push(Value::Null);
    }
    let [x, y, z] = axes;
    json!({
        "type": "scatter3d", "mode": "lines", "name": escaped(name), "x": x, "y": y, "z": z, "text": texts,
        "hovertemplate": "%{text}<extra></extra>", "line": { "color": color(index), "width": 4 },
        "visible": if index < SHOWN { json!(true) } else { json!("legendonly") },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_geometry::Mesh;

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
