//! From the rectilinear grid to the hall's shape, by a map that keeps every face of the grid planar.
//!
//! The side walls splay, x ↦ x (1 + k y), and the ceiling rises towards the rear, z ↦ z + m y w(z) with w = 0 up to
//! [`TILT_FROM`] and 1 at [`CEILING`]. A face x = const stays in the plane X = x (1 + k Y) wherever its points move in z; a face
//! y = const stays where it is; on a face z = const the new height is linear in y. No solid but the walls crosses
//! the kink of w, and the kink is a line of the grid.

use super::plan::{CEILING, TILT_FROM};

/// Widening of the hall per metre of length, k [1/m].
const SPLAY: f64 = 0.007;
/// Slope of the ceiling, m.
const TILT: f64 = 0.06;

/// Position [m] of the grid vertex `[x, y, z]` [dm].
///
/// All factors are short decimals, so five decimals in the file state the position exactly.
pub(super) fn place([x, y, z]: [i32; 3]) -> [f64; 3] {
    let [x, y, height] = [x, y, z].map(|v| f64::from(v) / 10.0);
    let above = f64::from((z - TILT_FROM).max(0)) / f64::from(CEILING - TILT_FROM);
    [x * (1.0 + SPLAY * y), y, height + TILT * y * above]
}
