//! Warns of receivers in the shadow of edges that the map leaves out.
//!
//! Sound over an edge is at most 1/(3 + 20 N) of the free field, N = 2·detour/λ: the thin screen of Kurze and Anderson in Maekawa's form shades
//! 0.4 to 3 dB less than a rigid one. The two loudest edges are added in phase, and occlusion by walls is ignored: the
//! estimate errs high.
//!
//! References: [Maekawa1968] (docs/references.md), docs/physics.md §5.

use std::f64::consts::{LOG10_E, PI};

use glam::DVec3;
use sonel_geometry::{Departure, Geometry};
use sonel_map::MapHeader;
use sonel_renderer::{ReceiverPoint, Rendering};

use super::{ASKED, Effect, LEVEL_DB};

/// A sentence for every receiver that may need diffraction, which the map decided by itself to leave out. `renderings` are those of
/// all sources at `receivers`.
#[must_use]
pub fn missing(
    header: &MapHeader,
    geometry: &Geometry,
    receivers: &[ReceiverPoint],
    renderings: &[Rendering],
) -> Vec<String> {
    let left_out = header.effects.iter().any(|effect| {
        let named = effect.name == Effect::Diffraction.name();
        named && !effect.on.contains(&true) && !effect.reason.starts_with(ASKED)
    });
    if !left_out {
        return Vec::new();
    }
    let scene = &header.scene;
    let mut missing = Vec::new();
    for (number, (source, rendering)) in scene.sources.iter().zip(renderings).enumerate() {
        let own_air = scene.air_at_source(number);
        for (index, receiver) in receivers.iter().enumerate() {
            // No way over edges leads into another air.
            let air = scene.media.as_ref().map_or(0, |media| media.airs(geometry).at(receiver.position));
            if air != own_air {
                continue;
            }
            let Some(ways) = loudest_ways(geometry, source.position, receiver.position) else { continue };
            let (gain_db, band) = (0..scene.bands.count())
                .map(|band| {
                    let wavelength = scene.speed_of_sound / scene.bands.nominal()[band];
                    let rendered = rendering.energy(index, band);
                    (10.0 * LOG10_E * libm::log1p(over_edges(ways, wavelength) / rendered), band)
                })
                .fold((0.0, 0), |most, gain| if gain.0 > most.0 { gain } else { most });
            if gain_db > LEVEL_DB {
                let gain = gain(gain_db, scene.bands.nominal()[band]);
                missing.push(format!(
                    "receiver \"{}\" is in the shadow of source \"{}\": sound over edges, which the map omits, {gain}; trace with --effects auto,+diffraction to include it",
                    receiver.name, source.name
                ));
            }
        }
    }
    missing
}

/// What sound over edges does to a level at `center_hz` that it raises by up to `gain_db`.
fn gain(gain_db: f64, center_hz: f64) -> String {
    if gain_db.is_finite() {
        format!("may raise its level by up to {gain_db:.1} dB at {center_hz} Hz")
    } else {
        format!("may be all that reaches it at {center_hz} Hz")
    }
}

/// Length and detour of the two shortest ways over edges [m]; none where the direct path is clear or there is no edge.
fn loudest_ways(geometry: &Geometry, source: DVec3, receiver: DVec3) -> Option<[(f64, f64); 2]> {
    let local = |place: DVec3| geometry.to_local(place);
    if !geometry.is_blocked(Departure::free(local(source)), local(receiver)) {
        return None;
    }
    let straight = source.distance(receiver);
    let nowhere = (f64::INFINITY, f64::INFINITY);
    let mut ways = [nowhere; 2];
    for edge in geometry.diffracting_edges() {
        let length = shortest_way(edge.ends, source, receiver);
        let way = (length, length - straight);
        if way.0 < ways[0].0 {
            ways = [way, ways[0]];
        } else if way.0 < ways[1].0 {
            ways[1] = way;
        }
    }
    (ways[0].0.is_finite()).then_some(ways)
}

/// Fluence over both ways in phase, per unit emitted energy [1/m²].
fn over_edges(ways: [(f64, f64); 2], wavelength: f64) -> f64 {
    let amplitude = |(length, detour): (f64, f64)| {
        let number = 2.0 * detour / wavelength;
        (1.0 / (4.0 * PI * length * length * (3.0 + 20.0 * number))).sqrt()
    };
    let sum: f64 = ways.into_iter().filter(|way| way.0.is_finite()).map(amplitude).sum();
    sum * sum
}

/// Length of the shortest way from `from` over an edge to `to` [m].
fn shortest_way(ends: [DVec3; 2], from: DVec3, to: DVec3) -> f64 {
    let length = ends[0].distance(ends[1]);
    let along = (ends[1] - ends[0]) / length;
    // Height above the line and place along it: unfolded about the edge the way is straight.
    let seen = |point: DVec3| {
        let offset = point - ends[0];
        let place = offset.dot(along);
        ((offset - place * along).length(), place)
    };
    let ((height, place), (other_height, other_place)) = (seen(from), seen(to));
    let share = height / (height + other_height).max(f64::MIN_POSITIVE);
    let over = ends[0] + along * (place + (other_place - place) * share).clamp(0.0, length);
    from.distance(over) + over.distance(to)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_way_is_that_of_the_unfolded_plane_or_over_an_end() {
        let ends = [DVec3::ZERO, DVec3::new(0.0, 0.0, 10.0)];
        let (from, to) = (DVec3::new(-3.0, 0.0, 2.0), DVec3::new(0.0, 5.0, 8.0));
        assert!((shortest_way(ends, from, to) - 10.0).abs() < 1e-12);
        let below = DVec3::new(0.0, 4.0, -3.0);
        let over_end = DVec3::new(-4.0, 0.0, -3.0);
        assert!((shortest_way(ends, below, over_end) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn where_nothing_else_arrives_no_gain_is_stated() {
        assert_eq!(gain(3.12, 125.0), "may raise its level by up to 3.1 dB at 125 Hz");
        assert_eq!(gain(f64::INFINITY, 125.0), "may be all that reaches it at 125 Hz");
    }

    #[test]
    fn a_screen_of_known_loss_is_not_underestimated() {
        // 10 m from a screen on either side, 1 m below its edge: 8.13 dB at 125 Hz, 19.01 dB at 4 kHz (docs/diffraction.md).
        let straight = 20.0;
        let length = 2.0 * 101.0_f64.sqrt();
        for (frequency, loss_db) in [(125.0, 8.13), (4000.0, 19.01)] {
            let nothing = (f64::INFINITY, f64::INFINITY);
            let found = over_edges([(length, length - straight), nothing], 343.0 / frequency);
            let exact = libm::pow(10.0, -loss_db / 10.0) / (4.0 * PI * straight * straight);
            assert!(found > exact && found < 2.0 * exact, "{frequency} Hz: {found} {exact}");
        }
    }
}
