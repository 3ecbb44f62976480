//! Rows of parallel edges grazed by one path, such as seats: they count as one edge.
//!
//! Parallel edges of different objects are each lit as if the others were not there. Where a path grazes many of them their sum would be several
//! times the field. So they count as one edge, each with the share that its clearance c has among theirs,
//!
//!   share = 1/(1 + Σ q exp((c − c′)/s)),  s = λ/20,
//!
//! over the others, c′ their clearances: how much longer the path over an edge is than the straight one, negative where the
//! edge shades it.
//! The one that shades most counts; two in line count half each. q is 1 for others that the way over the edge passes within a Fresnel number
//! of 1/4 and 0 from 1/2 on. Next to its own boundary, |c| < s/4, an edge counts wholly, or the wave would step there.
//!
//! One edge is half a plane that reaches far below the row, and takes up to 6 dB from a path that is not shaded. Where the others are nearer than a
//! third of a wave, it floats over the row instead: an edge that does not shade the path sends nothing, from a clearance of [`FADE`] on.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use sonel_diffraction::apex;

use super::visibility::over_edge;
use super::visibility::smooth;
use super::{Edges, RoomEdge};

/// s in wavelengths.
const SPREAD: f64 = 0.05;
/// Fresnel number from which on an edge is not grazed; half of it is grazed wholly.
const GRAZED: f64 = 0.5;
/// Clearance from which on an edge of a row that does not shade a path sends nothing [m].
const FADE: f64 = 4e-4;
/// The exponent is kept within so much.
const MOST: f64 = 50.0;

/// Another edge of the row.
struct Grazed {
    /// How much longer the way over both is than over the first [m].
    excess: f64,
    /// How much less its clearance is [m].
    lower: f64,
    /// How far apart they are [m].
    apart: f64,
}

/// The share of edge `index` among those that are grazed with it by a path between `ends` [m], in every cell. Whether the edge shades the path
/// is for `is_dark` to say where the path is reflected in a face of the edge; which other edges may be grazed, for `counts`.
#[must_use]
pub(super) fn in_row(
    edges: &Edges,
    index: usize,
    ends: [DVec3; 2],
    is_dark: Option<bool>,
    counts: impl Fn(&RoomEdge) -> bool,
) -> Vec<f64> {
    let edge = &edges.all[index];
    let (excess, place) = over_edge(&edge.wedge, ends[0], ends[1]);
    let own = match is_dark {
        Some(true) => -excess,
        Some(false) => excess,
        None => clearance(edge, ends),
    };
    let farthest = GRAZED * PI / edges.spectrum.smallest_k();
    let mut grazed: Vec<Grazed> = Vec::new();
    for &other in &edge.hiders {
        let other = &edges.all[other];
        let [one, two] = ends.map(|end| over_edge(&other.wedge, place, end));
        let (excess, there) = if one.0 < two.0 { one } else { two };
        if excess < farthest && counts(other) {
            let lower = own - clearance(other, ends);
            grazed.push(Grazed { excess, lower, apart: place.distance(there) });
        }
    }
    let share = |k: f64| {
        let grazes = |other: &Grazed| smooth(2.0 - 2.0 * other.excess * k / (PI * GRAZED));
        // 1 up to a third of a wave, 0 from two thirds on.
        let near = |other: &Grazed| if own > 0.0 { smooth(2.0 - 3.0 * other.apart * k / TAU) } else { 0.0 };
        let spread = TAU * SPREAD / k;
        let off = smooth(4.0 * own.abs() / spread);
        let one_of = |other: &Grazed| {
            let weight = libm::exp((other.lower / spread).clamp(-MOST, MOST));
            off * grazes(other) * weight
        };
        let floats = |other: &Grazed| smooth(own / FADE) * near(other) * grazes(other);
        let left: f64 = grazed.iter().map(|other| 1.0 - floats(other)).product();
        left / (1.0 + grazed.iter().map(one_of).sum::<f64>())
    };
    edges.spectrum.cells().iter().map(|cell| share(cell.k)).collect()
}

/// How much longer the way over an edge is than straight [m]; negative where the edge shades that, not beyond its ends.
fn clearance(edge: &RoomEdge, ends: [DVec3; 2]) -> f64 {
    let (excess, _) = over_edge(&edge.wedge, ends[0], ends[1]);
    match ends.map(|end| edge.wedge.locate(end)) {
        [Some(one), Some(other)] => {
            let is_between = (0.0..=edge.wedge.length()).contains(&apex(one, other));
            let is_dark = (one.angle - other.angle).abs() > PI;
            if is_dark && is_between { -excess } else { excess }
        }
        _ => -excess,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;
    use sonel_acoustics::{BandWidth, Bands};
    use sonel_geometry::{Geometry, Mesh, MeshTriangle};

    /// Shares of the upper rims of screens with these heights, half a metre apart, of a path at a `height` [m].
    fn shares(tops: &[f64], height: f64) -> Vec<Vec<f64>> {
        let mut mesh = Mesh::default();
        for (row, top) in tops.iter().enumerate() {
            let x = 0.5 * row as f64;
            let first = mesh.vertices.len() as u32;
            let corners = [[-2.0, 0.0], [2.0, 0.0], [2.0, *top], [-2.0, *top]];
            mesh.vertices.extend(corners.map(|[y, z]| dvec3(x, y, z)));
            let triangles = [[0, 1, 2], [0, 2, 3]].map(|corners: [u32; 3]| corners.map(|c| first + c));
            mesh.triangles.extend(triangles.map(|corners| MeshTriangle { corners, material: 0 }));
        }
        let geometry = Geometry::build(mesh).unwrap();
        let bands = Bands::new(vec![125.0, 4000.0], BandWidth::Octave).unwrap();
        let edges = Edges::new(&geometry, &bands, 343.0).unwrap();
        let ends = [dvec3(-4.0, 0.0, height), dvec3(6.0, 0.0, height)].map(|end| end - geometry.center());
        let is_top = |edge: &RoomEdge, top: &f64| {
            let height = |along: f64| edge.wedge.at(along).z + geometry.center().z;
            (height(0.0) - top).abs() < 1e-9 && (height(edge.wedge.length()) - top).abs() < 1e-9
        };
        let of_row = |(row, top): (usize, &f64)| {
            let x = 0.5 * row as f64 - geometry.center().x;
            let index = edges
                .all
                .iter()
                .position(|edge| is_top(edge, top) && (edge.wedge.at(0.0).x - x).abs() < 1e-9);
            in_row(&edges, index.unwrap(), ends, None, |_| true)
        };
        tops.iter().enumerate().map(of_row).collect()
    }

    #[test]
    fn what_is_grazed_together_counts_once() {
        let alone = &shares(&[1.5], 2.0)[0];
        assert!(alone.iter().all(|share| *share >= 1.0), "{alone:?}");
        let rows = shares(&[1.5; 4], 0.9);
        let lowest: f64 = rows.iter().map(|shares| shares[0]).sum();
        assert!((lowest - 1.0).abs() < 0.2, "{lowest}");
        let [lower, higher] = &shares(&[1.0, 2.5], 2.0)[..] else { unreachable!() };
        assert!(higher.iter().all(|share| *share > 0.99), "{higher:?}");
        assert!(lower[0] < 0.2, "what shades more counts: {lower:?}");
    }

    #[test]
    fn long_waves_float_over_rows_that_do_not_shade_them() {
        let rows = shares(&[1.5; 4], 2.0);
        assert!(rows.iter().all(|shares| shares[0] < 1e-9), "{rows:?}");
        let short: f64 = rows.iter().map(|shares| shares[shares.len() - 1]).sum();
        assert!((short - 1.0).abs() < 0.1, "4 kHz: {rows:?}");
    }
}
