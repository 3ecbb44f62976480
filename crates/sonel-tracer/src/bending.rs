//! A packet's way past edges: bent by those within reach of the band that leads it, straight on by others.
//!
//! Edges are passed in the order of their feet. A packet that was bent is bent again only after it has gone on by the distance at
//! which that edge was passed, so that both edges of a thin obstacle bend it once; and no edge bends it twice before it meets a
//! surface. Where no carried band is in reach nothing is written down: the way is straight for all.
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use sonel_geometry::{EdgeIndex, Geometry, Passage, Way};
use sonel_map::{EdgePlace, EdgeTable, Event};
use sonel_sampling::{Stream, warp};

/// Edges that may bend a packet between two surfaces; a way that is bent more often goes straight on.
const MOST_BENDS: usize = 8;

/// What a packet has done since it left a surface or the source.
#[derive(Debug, Clone, Copy, Default)]
pub struct Course {
    bent_by: [u32; MOST_BENDS],
    bends: usize,
    /// How far it goes before an edge may bend it [m].
    pub clear: f64,
}

impl Course {
    /// The course of a packet that no edge bends before it has gone on by `clear` [m].
    #[must_use]
    pub fn new(clear: f64) -> Self {
        Self { clear, ..Self::default() }
    }

    fn may_pass(&self, edge: u32) -> bool {
        self.bends < MOST_BENDS && !self.bent_by[..self.bends].contains(&edge)
    }

    /// The first passage of an edge from `way.from` on that matters to any band in reach.
    #[must_use]
    pub fn next(&self, edges: &EdgeIndex, geometry: &Geometry, way: &Way) -> Option<Passage> {
        if way.reach < 0.0 { None } else { edges.first(geometry, way, |edge| self.may_pass(edge)) }
    }

    /// Notes that `edge` has bent the packet at `distance` [m].
    pub fn bend(&mut self, edge: u32, distance: f64) {
        self.bent_by[self.bends] = edge;
        self.bends += 1;
        self.clear = distance;
    }
}

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
