//! Which closed shells lie within which.

use crate::Mesh;
use crate::enclosure::winding_number;
use crate::orient::Shell;
use glam::{DVec3, IVec3};
use std::collections::HashMap;

/// For each shell, how many others it lies in.
pub(crate) fn nesting_depths(mesh: &Mesh, shells: &[Shell]) -> Vec<u32> {
    let boxes: Vec<(DVec3, DVec3)> = shells.iter().map(|shell| mesh.bounds_of(&shell.triangles)).collect();
    let grid = BoxGrid::new(&boxes);
    (0..shells.len())
        .map(|inner| {
            let middle = 0.5 * (boxes[inner].0 + boxes[inner].1);
            let within = |&&outer: &&u32| {
                let (outer, own) = (outer as usize, inner);
                outer != own
                    && shells[outer].volume.abs() > shells[own].volume.abs()
                    && overlaps(boxes[outer], boxes[own])
                    && lies_in(mesh, &shells[own], &shells[outer])
            };
            grid.around(middle).iter().filter(within).count() as u32
        })
        .collect()
}

fn overlaps(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> bool {
    a.0.cmple(b.1).all() && b.0.cmple(a.1).all()
}

/// At most this many triangles vote on where a shell lies; one does unless shells touch.
const VOTES: usize = 64;

/// Whether a shell lies in another, which it may touch but not cross.
fn lies_in(mesh: &Mesh, inner: &Shell, outer: &Shell) -> bool {
    let stride = inner.triangles.len().div_ceil(VOTES);
    let mut turns = Vec::new();
    for &triangle in inner.triangles.iter().step_by(stride) {
        let [a, b, c] = mesh.corners(triangle);
        let turn = winding_number(mesh, &outer.triangles, (a + b + c) / 3.0).abs();
        // A half where the shells touch, so anything clearly nearer to 0 or 1 settles it.
        if !(0.25..0.75).contains(&turn) {
            return turn > 0.5;
        }
        turns.push(turn);
    }
    turns.iter().sum::<f64>() > 0.5 * turns.len() as f64
}

/// Boxes by the cells of a grid they cover, about as many cells as boxes.
struct BoxGrid {
    low: DVec3,
    cells_per_metre: DVec3,
    cells: HashMap<IVec3, Vec<u32>>,
}

impl BoxGrid {
    fn new(boxes: &[(DVec3, DVec3)]) -> Self {
        let (low, high) = boxes
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), b| (low.min(b.0), high.max(b.1)));
        let cells_per_side = libm::cbrt(boxes.len() as f64).ceil();
        let cells_per_metre =
            DVec3::splat(cells_per_side) / (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
        let mut grid = Self { low, cells_per_metre, cells: HashMap::new() };
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
    fn around(&self, point: DVec3) -> &[u32] {
        self.cells.get(&self.cell(point)).map_or(&[], Vec::as_slice)
    }
}
