//! Edges that are grazed together, as those of rows of seats.
//!
//! Parallel edges of different objects are each lit as if the others were not there. Where a path grazes many of them their sum would be several
//! times the field. So those that are grazed together count as one edge, each with the share that its clearance c has among theirs,
//!
//!   share = 1/(1 + Σ q exp((c − c′)/s)),  s = λ/20,
//!
//! over the others, c′ their clearances: how much longer the way over an edge is than the straight one, negative where the edge shades it.
//! The one that shades most counts; two in line count half each. q is 1 for others that the way over the edge passes within a Fresnel number
//! of 1/4 and 0 from 1/2 on.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::images::over_edge;
use super::visibility::smooth;
use super::{Edges, RoomEdge};

/// s in wavelengths.
const SPREAD: f64 = 0.05;
/// Fresnel number from which on an edge is not grazed; half of it is grazed wholly.
const GRAZED: f64 = 0.5;
/// The exponent is kept within so much.
const MOST: f64 = 50.0;

/// The share of edge `index` among those that are grazed with it by a path between `ends` [m], in every cell. Whether the edge shades the path
/// is for `is_dark` to say where the path is reflected in a face of the edge.
#[must_use]
pub(super) fn in_row(edges: &Edges, index: usize, ends: [DVec3; 2], is_dark: Option<bool>) -> Vec<f64> {
    let edge = &edges.all[index];
    let (excess, place) = over_edge(&edge.wedge, ends[0], ends[1]);
    let own = match is_dark {
        Some(true) => -excess,
        Some(false) => excess,
        None => clearance(edge, ends),
    };
    let farthest = GRAZED * PI / edges.spectrum.smallest_k();
    let mut grazed: Vec<(f64, f64)> = Vec::new();
    for &other in &edge.hiders {
        let other = &edges.all[other];
        let excess = ends.map(|end| over_edge(&other.wedge, place, end).0);
        let excess = excess[0].min(excess[1]);
        if excess < farthest {
            grazed.push((excess, own - clearance(other, ends)));
        }
    }
    let share = |k: f64| {
        let of = |&(excess, lower): &(f64, f64)| {
            let grazes = smooth(2.0 - 2.0 * excess * k / (PI * GRAZED));
            grazes * libm::exp((lower * k / (TAU * SPREAD)).clamp(-MOST, MOST))
        };
        1.0 / (1.0 + grazed.iter().map(of).sum::<f64>())
    };
    edges.spectrum.cells().iter().map(|cell| share(cell.k)).collect()
}

/// How much longer the way over an edge is than straight [m]; negative where the edge shades that.
fn clearance(edge: &RoomEdge, ends: [DVec3; 2]) -> f64 {
    let (excess, _) = over_edge(&edge.wedge, ends[0], ends[1]);
    match ends.map(|end| edge.wedge.locate(end)) {
        [Some(one), Some(other)] if (one.angle - other.angle).abs() <= PI => excess,
        _ => -excess,
    }
}
