//! Packets at edges: bent where the edge is within reach of the lead band, else passed straight. Where no carried band is
//! within reach no vertex is stored.
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use glam::DVec3;
use sonel_map::{EdgePlace, EdgeTable, Event, Passing};
use sonel_sampling::{Stream, warp};

/// What a packet from `from` led by the band `deciding` does where it passes `edge` at `place`, whose tangent is zero.
#[must_use]
pub fn decide(
    edges: &EdgeTable,
    (from, edge, place): (DVec3, u32, EdgePlace),
    deciding: usize,
    stream: &mut Stream,
) -> (Event, Passing) {
    let straight = edges.passing(from, edge, &place);
    let distance = f64::from(place.distance);
    if !edges.bends(deciding, distance, straight.seen.before) {
        return (Event::Passed, straight);
    }
    let [normal, _] = warp::normal_pair(stream.uniform_pair());
    let tangent = edges.tangent(deciding, distance, normal) as f32;
    let turned = |tangent| edges.passing(from, edge, &EdgePlace { tangent, ..place });
    let passing = turned(tangent);
    let is_preferred = edges.preference(deciding, &passing.seen) > 0.0;
    (Event::Bent, if is_preferred { passing } else { turned(-tangent) })
}
