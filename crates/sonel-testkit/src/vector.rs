//! Three numbers as a point or a direction; only what the rooms of this crate need.

/// Sum of the products of the components.
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The step that leads from `from` to `to`.
pub(crate) fn difference(to: [f64; 3], from: [f64; 3]) -> [f64; 3] {
    [to[0] - from[0], to[1] - from[1], to[2] - from[2]]
}

/// Distance between two points [m].
pub(crate) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let d = difference(a, b);
    dot(d, d).sqrt()
}
