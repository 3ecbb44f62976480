//! What a packet does where it passes an edge: bent where that is within reach of the band that leads it, straight on where not.
//! Where no carried band is in reach nothing is written down: the way is straight for all.
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use sonel_geometry::Passage;
use sonel_map::{EdgePlace, EdgeTable, Event};
use sonel_sampling::{Stream, warp};

/// What a packet led by `deciding` does at a passage, as it is written down.
#[must_use]
pub fn pass(
    edges: &EdgeTable,
    passage: &Passage,
    deciding: usize,
    stream: &mut Stream,
) -> (Event, EdgePlace) {
    let place = EdgePlace {
        along: passage.along as f32,
        distance: passage.distance as f32,
        tangent: 0.0,
        side: passage.side,
    };
    decide(edges, place, deciding, stream)
}

/// Event and angle for a packet led by `deciding` where it passes at `place`.
#[must_use]
pub fn decide(
    edges: &EdgeTable,
    place: EdgePlace,
    deciding: usize,
    stream: &mut Stream,
) -> (Event, EdgePlace) {
    let distance = f64::from(place.distance);
    if edges.bends(deciding, distance) {
        let [normal, _] = warp::normal_pair(stream.uniform_pair());
        (Event::Bent, EdgePlace { tangent: edges.tangent(deciding, distance, normal) as f32, ..place })
    } else {
        (Event::Passed, place)
    }
}
