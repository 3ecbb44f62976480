//! The walls of a box as patches: what one sends to another, and how long that takes.

use std::f64::consts::PI;

use super::form_factor::{parallel_exchange, perpendicular_exchange, solid_angle};
use crate::vector::distance;

/// One rectangle of a wall.
pub(super) struct Patch {
    /// Number of the wall: x0 x1 y0 y1 z0 z1.
    pub(super) wall: usize,
    /// Extent along each axis [m]; along the wall's own axis a point.
    pub(super) extent: [[f64; 2]; 3],
    pub(super) centre: [f64; 3],
    /// [m²]
    pub(super) area: f64,
}

/// The two axes that span the walls across `axis`, ascending.
pub(super) fn across(axis: usize) -> [usize; 2] {
    [[1, 2], [0, 2], [0, 1]][axis]
}

/// The walls of a box of `size`, each axis in as many cells as given, their ends spaced like the cosines of equal
/// angles.
pub(super) fn divide(size: [f64; 3], cells: [usize; 3]) -> Vec<Patch> {
    let end = |axis: usize, i: usize| 0.5 * size[axis] * (1.0 - (PI * i as f64 / cells[axis] as f64).cos());
    let cell = |axis: usize, i: usize| [end(axis, i), end(axis, i + 1)];
    let mut patches = Vec::new();
    for wall in 0..6 {
        let axis = wall / 2;
        let [a, b] = across(axis);
        let plane = if wall % 2 == 0 { 0.0 } else { size[axis] };
        for i in 0..cells[a] {
            for j in 0..cells[b] {
                let mut extent = [[plane; 2]; 3];
                (extent[a], extent[b]) = (cell(a, i), cell(b, j));
                patches.push(Patch {
                    wall,
                    extent,
                    centre: extent.map(|[low, high]| 0.5 * (low + high)),
                    area: (extent[a][1] - extent[a][0]) * (extent[b][1] - extent[b][0]),
                });
            }
        }
    }
    patches
}

/// A·F [m²] between two patches; zero within one wall.
fn exchange(p: &Patch, q: &Patch) -> f64 {
    let (axis, other) = (p.wall / 2, q.wall / 2);
    if p.wall == q.wall {
        return 0.0;
    }
    if axis == other {
        let [a, b] = across(axis);
        let gap = (p.centre[axis] - q.centre[axis]).abs();
        return parallel_exchange([p.extent[a], p.extent[b]], [q.extent[a], q.extent[b]], gap);
    }
    let shared = 3 - axis - other;
    // Distances of a patch from the wall of the other, ascending.
    let from = |extent: [f64; 2], plane: f64| {
        let [low, high] = extent.map(|x| (x - plane).abs());
        [low.min(high), low.max(high)]
    };
    let first = [from(p.extent[other], q.centre[other]), p.extent[shared]];
    let second = [from(q.extent[axis], p.centre[axis]), q.extent[shared]];
    perpendicular_exchange(first, second)
}

/// Part of the energy leaving patch j (column) that arrives at patch i (row).
pub(super) fn form_factors(patches: &[Patch]) -> Vec<f64> {
    let number = patches.len();
    let mut matrix = vec![0.0; number * number];
    for (i, p) in patches.iter().enumerate() {
        for (j, q) in patches.iter().enumerate().take(i) {
            let exchange = exchange(p, q);
            matrix[i * number + j] = exchange / q.area;
            matrix[j * number + i] = exchange / p.area;
        }
    }
    matrix
}

/// Gauss's three nodes of the unit interval, 0.5 and 0.5 ± √0.15, with their weights.
const NODES: [(f64, f64); 3] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Mean length of the ways from patch to patch [m], weighted with the energy they carry.
pub(super) fn lengths(patches: &[Patch]) -> Vec<f64> {
    let number = patches.len();
    let mut matrix = vec![0.0; number * number];
    for (i, p) in patches.iter().enumerate() {
        for (j, q) in patches.iter().enumerate().take(i).filter(|(_, q)| q.wall != p.wall) {
            let length = mean_length(p, q);
            (matrix[i * number + j], matrix[j * number + i]) = (length, length);
        }
    }
    matrix
}

/// ∫∫ K l / ∫∫ K over two patches, K = cos θ cos θ′/(π l²). The denominator is the closed form.
fn mean_length(p: &Patch, q: &Patch) -> f64 {
    // K l grows like 1/l towards a shared edge: there the rule is applied to pieces.
    let near = distance(p.centre, q.centre) < p.diagonal() + q.diagonal();
    let pieces = if near { 3 } else { 1 };
    let arrivals = q.nodes(pieces);
    let kernel = |at: [f64; 3], to: [f64; 3]| {
        let cosines = (at[p.wall / 2] - to[p.wall / 2]) * (at[q.wall / 2] - to[q.wall / 2]);
        cosines.abs() / (PI * distance(at, to).powi(3))
    };
    let from = |&(at, weight): &([f64; 3], f64)| {
        weight * arrivals.iter().map(|&(to, weight)| weight * kernel(at, to)).sum::<f64>()
    };
    p.nodes(pieces).iter().map(from).sum::<f64>() / exchange(p, q)
}

impl Patch {
    /// Solid angle seen from a point inside of the box [sr].
    pub(super) fn solid_angle(&self, from: [f64; 3]) -> f64 {
        let axis = self.wall / 2;
        let ends = |side: usize| across(axis).map(|k| self.extent[k][side] - from[k]);
        solid_angle(ends(0), ends(1), (self.centre[axis] - from[axis]).abs())
    }

    fn diagonal(&self) -> f64 {
        distance(self.extent.map(|ends| ends[0]), self.extent.map(|ends| ends[1]))
    }

    /// Nodes of Gauss's rule on `pieces`² equal parts, with weights that sum to the area [m²].
    fn nodes(&self, pieces: usize) -> Vec<([f64; 3], f64)> {
        let [a, b] = across(self.wall / 2);
        let along = |[low, high]: [f64; 2]| {
            let step = (high - low) / pieces as f64;
            (0..pieces)
                .flat_map(move |i| NODES.map(|(at, weight)| (low + (i as f64 + at) * step, weight * step)))
                .collect::<Vec<_>>()
        };
        let (on_a, on_b) = (along(self.extent[a]), along(self.extent[b]));
        let mut nodes = Vec::with_capacity(on_a.len() * on_b.len());
        for &(u, first) in &on_a {
            for &(v, second) in &on_b {
                let mut at = self.centre;
                (at[a], at[b]) = (u, v);
                nodes.push((at, first * second));
            }
        }
        nodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walls() -> Vec<Patch> {
        divide([6.0, 5.0, 4.0], [6, 5, 3])
    }

    #[test]
    fn nothing_escapes_through_the_seams() {
        let (patches, factors) = (walls(), form_factors(&walls()));
        let number = patches.len();
        for j in 0..number {
            let sent = (0..number).map(|i| factors[i * number + j]).sum::<f64>();
            assert!((sent - 1.0).abs() < 1e-10, "patch {j}: {sent}");
        }
        let seen = patches.iter().map(|patch| patch.solid_angle([1.5, 1.2, 1.3])).sum::<f64>();
        assert!((seen - 4.0 * PI).abs() < 1e-12);
        assert!((patches.iter().map(|patch| patch.area).sum::<f64>() - 148.0).abs() < 1e-12);
    }

    #[test]
    fn each_patch_sends_to_where_it_looks() {
        // Point to point between distant patches, which knows nothing of ends and common lines.
        let patches = divide([6.0, 5.0, 4.0], [12, 10, 8]);
        let factors = form_factors(&patches);
        let cosine = |from: &Patch, to: &Patch, length: f64| {
            let axis = from.wall / 2;
            (to.centre[axis] - from.centre[axis]).abs() / length
        };
        for (i, p) in patches.iter().enumerate() {
            for (j, q) in patches.iter().enumerate().filter(|(_, q)| q.wall != p.wall) {
                let d = distance(p.centre, q.centre);
                let slant = cosine(p, q, d) * cosine(q, p, d);
                if d > 3.0 && slant > 0.2 {
                    let expected = slant * p.area / (PI * d * d);
                    let found = factors[i * patches.len() + j];
                    assert!((found / expected - 1.0).abs() < 0.05, "{i} {j}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn the_mean_way_is_the_mean_free_path() {
        let mean = |patches: &[Patch]| {
            let (factors, lengths, number) = (form_factors(patches), lengths(patches), patches.len());
            let way = |at: usize| patches[at % number].area * factors[at] * lengths[at];
            (0..number * number).map(way).sum::<f64>() / 148.0
        };
        let expected = 4.0 * 120.0 / 148.0;
        let coarse = (mean(&divide([6.0, 5.0, 4.0], [4; 3])) / expected - 1.0).abs();
        let fine = (mean(&divide([6.0, 5.0, 4.0], [8; 3])) / expected - 1.0).abs();
        assert!(coarse < 2e-3 && fine < 0.4 * coarse, "{coarse} {fine}");
    }
}
