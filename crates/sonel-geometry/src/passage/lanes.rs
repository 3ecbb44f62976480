//! Edges side by side, so that a way or a point is compared with several at once.

use super::line::EdgeLine;
use glam::DVec3;

/// Edges in a block.
pub(super) const LANES: usize = 8;

/// Up to [`LANES`] edges. Unused lanes have no length, and nothing is nearest to what lies within them.
#[derive(Debug, Clone)]
pub(super) struct Block {
    /// Origin and direction, by axis and lane.
    origin: [[f64; LANES]; 3],
    along: [[f64; LANES]; 3],
    length: [f64; LANES],
    /// Their numbers.
    pub edges: [u32; LANES],
    /// Used lanes.
    pub count: usize,
}

/// Where a way's line is nearest to those of the edges of a block.
pub(super) struct Approaches {
    /// How far on the way [m].
    pub at: [f64; LANES],
    /// How far on the edge [m].
    pub along: [f64; LANES],
    /// Square of the distance [m²].
    pub squared: [f64; LANES],
    /// Whether it is within the edge at all, and neither is parallel to the other.
    pub is_on_edge: [bool; LANES],
}

/// Where the edges of a block are nearest to a point.
pub(super) struct Distances {
    /// Square of the distance [m²].
    pub squared: [f64; LANES],
    /// How far on the edge [m].
    pub along: [f64; LANES],
}

/// Square of the sine below which a way and an edge are parallel: nothing passes anything.
const PARALLEL: f64 = 1e-12;

impl Block {
    /// A block of `edges`, at most [`LANES`] of those along `lines`.
    pub fn new(edges: &[u32], lines: &[EdgeLine]) -> Self {
        let mut block = Self {
            origin: [[0.0; LANES]; 3],
            along: [[0.0; LANES]; 3],
            length: [0.0; LANES],
            edges: [u32::MAX; LANES],
            count: edges.len(),
        };
        for (lane, &edge) in edges.iter().enumerate() {
            let line = &lines[edge as usize];
            for axis in 0..3 {
                block.origin[axis][lane] = line.origin[axis];
                block.along[axis][lane] = line.along[axis];
            }
            block.length[lane] = line.length;
            block.edges[lane] = edge;
        }
        block
    }

    /// The shortest distances between the line from `origin` in a unit `direction` and those of the edges.
    #[inline]
    pub fn approaches(&self, origin: DVec3, direction: DVec3) -> Approaches {
        let mut found = Approaches {
            at: [0.0; LANES],
            along: [0.0; LANES],
            squared: [0.0; LANES],
            is_on_edge: [false; LANES],
        };
        let [ox, oy, oz] = &self.origin;
        let [ax, ay, az] = &self.along;
        for lane in 0..LANES {
            let (x, y, z) = (origin.x - ox[lane], origin.y - oy[lane], origin.z - oz[lane]);
            let slant = direction.x * ax[lane] + direction.y * ay[lane] + direction.z * az[lane];
            let height = x * ax[lane] + y * ay[lane] + z * az[lane];
            let behind = x * direction.x + y * direction.y + z * direction.z;
            let across_squared = 1.0 - slant * slant;
            let at = (height * slant - behind) / across_squared;
            let aside = x * x + y * y + z * z - height * height - at * at * across_squared;
            let along = height + at * slant;
            found.at[lane] = at;
            found.along[lane] = along;
            found.squared[lane] = if aside > 0.0 { aside } else { 0.0 };
            found.is_on_edge[lane] =
                (across_squared >= PARALLEL) & (along > 0.0) & (along < self.length[lane]);
        }
        found
    }

    /// The distances of the edges from a `point`.
    #[inline]
    pub fn distances(&self, point: DVec3) -> Distances {
        let mut found = Distances { squared: [0.0; LANES], along: [0.0; LANES] };
        let [ox, oy, oz] = &self.origin;
        let [ax, ay, az] = &self.along;
        for lane in 0..LANES {
            let (x, y, z) = (point.x - ox[lane], point.y - oy[lane], point.z - oz[lane]);
            let along = (x * ax[lane] + y * ay[lane] + z * az[lane]).clamp(0.0, self.length[lane]);
            let x = point.x - (ox[lane] + along * ax[lane]);
            let y = point.y - (oy[lane] + along * ay[lane]);
            let z = point.z - (oz[lane] + along * az[lane]);
            found.squared[lane] = x * x + y * y + z * z;
            found.along[lane] = along;
        }
        found
    }
}
