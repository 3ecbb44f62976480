//! Which closed shells lie within which.

use crate::Mesh;
use crate::enclosure::winding_number;
use crate::grid::BoxGrid;
use glam::DVec3;

/// A closed, consistently oriented component.
#[derive(Debug, Clone)]
pub(crate) struct Shell {
    /// Its triangles in ascending order.
    pub triangles: Vec<u32>,
    /// How many other shells it lies in.
    pub depth: u32,
    /// Volume it encloses [m³].
    pub volume: f64,
    /// Whether it is but two sheets back to back: it has no inside.
    pub is_flat: bool,
}

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
