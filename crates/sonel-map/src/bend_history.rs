//! The edges that a packet passes between two surfaces.
//!
//! Edges are passed in the order of their closest points. After a bend at distance b a packet continues by b before the
//! next bend, so the two edges of a thin obstacle bend it once. No edge bends it twice before it meets a surface.
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use sonel_geometry::{EdgeIndex, EdgePass, Geometry, Way};

use crate::edges::EdgeTable;
use crate::lanes::Lanes;

/// Edges that may bend a packet between two surfaces; a way that is bent more often goes straight on.
pub const MOST_BENDS: usize = 64;

/// What a packet has done since it left a surface or the source.
#[derive(Debug, Clone, Copy)]
pub struct BendHistory {
    bent_by: [u32; MOST_BENDS],
    bends: usize,
    /// How far it goes before an edge may bend it [m].
    pub clear: f64,
}

impl Default for BendHistory {
    fn default() -> Self {
        Self::new(0.0)
    }
}

impl BendHistory {
    /// The course of a packet that no edge bends before it has gone on by `clear` [m].
    #[must_use]
    pub fn new(clear: f64) -> Self {
        Self { bent_by: [0; MOST_BENDS], bends: 0, clear }
    }

    fn may_pass(&self, edge: u32) -> bool {
        self.bends < MOST_BENDS && !self.bent_by[..self.bends].contains(&edge)
    }

    /// The first passage of an edge from `way.from` on that bends any band of those with `energy`.
    #[must_use]
    pub fn next(
        &self,
        (edges, table): (&EdgeIndex, &EdgeTable),
        geometry: &Geometry,
        way: &Way,
        energy: &[Lanes],
    ) -> Option<EdgePass> {
        let matters = |edge: u32, squared: f64| {
            self.may_pass(edge) && table.bends_any(energy, edge, squared, way.direction)
        };
        if way.reach < 0.0 { None } else { edges.first(geometry, way, matters) }
    }

    /// Notes that `edge` has bent the packet at `distance` [m].
    pub fn bend(&mut self, edge: u32, distance: f64) {
        self.bent_by[self.bends] = edge;
        self.bends += 1;
        self.clear = distance;
    }
}
