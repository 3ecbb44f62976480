//! Joining vertices that are the same point, and dropping triangles without area.

use crate::Mesh;
use crate::scale::Scale;
use foldhash::HashMap;
use glam::DVec3;
use std::iter::successors;

/// A welded mesh and what welding did to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Welded {
    /// The mesh: every vertex is used, no two are closer than the tolerance unless a chain of such pairs kept them
    /// apart, every triangle has an area.
    pub mesh: Mesh,
    /// Triangles that were dropped because they have no area.
    pub dropped: usize,
}

impl Mesh {
    /// Joins vertices closer than the scene's resolution and drops triangles of zero area.
    ///
    /// The first vertex of each group keeps its position, and unused vertices are left out. Corners must be valid
    /// indices and coordinates finite.
    pub fn welded(&self) -> Welded {
        let (low, high) = self.bounds();
        let tolerance = f64::from(Scale::of_bounds(low, high).resolution());
        let mut grid = Points::new(tolerance, &[]);
        let mut renamed = vec![u32::MAX; self.vertices.len()];
        let mut welded = Welded { mesh: Mesh::default(), dropped: 0 };
        for triangle in &self.triangles {
            let corners = triangle.corners.map(|corner| {
                let name = &mut renamed[corner as usize];
                if *name == u32::MAX {
                    *name = grid.join(self.vertices[corner as usize]);
                }
                *name
            });
            if has_area(corners.map(|corner| grid.places[corner as usize]), tolerance) {
                welded.mesh.triangles.push(crate::MeshTriangle { corners, ..*triangle });
            } else {
                welded.dropped += 1;
            }
        }
        welded.mesh.vertices = grid.places;
        welded
    }
}

/// Whether the corners span a triangle higher than the tolerance could hide.
pub(crate) fn has_area([a, b, c]: [DVec3; 3], tolerance: f64) -> bool {
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    // Height over the longest side; flatter than this its rounded corners may be collinear or turned over.
    (b - a).cross(c - a).length() > longest * tolerance
}

/// Width of a cell [tolerances]: a point has candidates in a second cell along an axis in 2 of 32 cases. Speed alone depends on it.
const TOLERANCES_PER_CELL: f64 = 32.0;

/// Points by the cell they are in, none nearer to another than the tolerance.
pub(crate) struct Points {
    /// Positions of the points [m].
    pub places: Vec<DVec3>,
    tolerance: f64,
    /// The last point of each cell.
    last: HashMap<[i64; 3], u32>,
    /// For each point the one before it in its cell.
    previous: Vec<Option<u32>>,
}

impl Points {
    /// Some points that are as far apart as they have to be.
    pub(crate) fn new(tolerance: f64, places: &[DVec3]) -> Self {
        let mut points =
            Self { places: Vec::new(), tolerance, last: HashMap::default(), previous: Vec::new() };
        places.iter().for_each(|&place| {
            points.push(place);
        });
        points
    }

    fn cell(&self, point: DVec3) -> [i64; 3] {
        let scaled = point / (TOLERANCES_PER_CELL * self.tolerance);
        [scaled.x.floor() as i64, scaled.y.floor() as i64, scaled.z.floor() as i64]
    }

    fn push(&mut self, point: DVec3) -> u32 {
        let index = self.places.len() as u32;
        self.previous.push(self.last.insert(self.cell(point), index));
        self.places.push(point);
        index
    }

    /// The earliest point within the tolerance, or this one as a new point.
    pub(crate) fn join(&mut self, point: DVec3) -> u32 {
        let low = self.cell(point - self.tolerance);
        let high = self.cell(point + self.tolerance);
        let mut found = u32::MAX;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let last = self.last.get(&[x, y, z]).copied();
                    for candidate in successors(last, |&point| self.previous[point as usize]) {
                        if self.places[candidate as usize].distance(point) <= self.tolerance {
                            found = found.min(candidate);
                        }
                    }
                }
            }
        }
        if found == u32::MAX { self.push(point) } else { found }
    }
}
