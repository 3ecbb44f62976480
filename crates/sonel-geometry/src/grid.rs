//! A grid of cells that tells which of many boxes may hold a point.

use crate::mesh::bounds_of_points;
use foldhash::HashMap;
use glam::{DVec3, IVec3};

/// Boxes by the cells of a grid they cover, about as many cells as boxes.
pub(crate) struct BoxGrid {
    low: DVec3,
    cells_per_metre: DVec3,
    cells: HashMap<IVec3, Vec<u32>>,
}

impl BoxGrid {
    /// Files some boxes, each a lower and an upper corner.
    pub(crate) fn new(boxes: &[(DVec3, DVec3)]) -> Self {
        let (low, high) = bounds_of_points(boxes.iter().flat_map(|&(low, high)| [low, high]));
        let cells_per_side = libm::cbrt(boxes.len() as f64).ceil();
        let cells_per_metre =
            DVec3::splat(cells_per_side) / (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
        let mut grid = Self { low, cells_per_metre, cells: HashMap::default() };
        for (index, &(low, high)) in boxes.iter().enumerate() {
            let (first, last) = (grid.cell(low), grid.cell(high));
            for x in first.x..=last.x {
                for y in first.y..=last.y {
                    for z in first.z..=last.z {
                        grid.cells.entry(IVec3::new(x, y, z)).or_default().push(index as u32);
                    }
                }
            }
        }
        grid
    }

    fn cell(&self, point: DVec3) -> IVec3 {
        ((point - self.low) * self.cells_per_metre).floor().as_ivec3()
    }

    /// Every box that holds a point, and perhaps others.
    pub(crate) fn around(&self, point: DVec3) -> &[u32] {
        self.cells.get(&self.cell(point)).map_or(&[], Vec::as_slice)
    }
}
