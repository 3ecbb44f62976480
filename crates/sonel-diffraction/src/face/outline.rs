//! Which parts of a rim are seen from another one over their sheet.
//!
//! Over a sheet that is not convex sound runs straight, and where it leaves the sheet it is cut off: what would come back onto it beyond a
//! notch or a window is none of its. Every straight way from a point of the sheet leaves it first over one rim, so that
//! the parts that are seen from there, all rims together, are a closed line about it.

use glam::DVec3;

use super::FaceEdge;

/// What is nearer than this to the line of a rim, or to the height of the point that looks, hides nothing [m].
const TOUCH: f64 = 1e-6;

/// The parts of `last`, from its start [m], that are seen over the sheet from the point `from` of the edge `before`.
pub(super) fn stretches(before: &FaceEdge<'_>, last: &FaceEdge<'_>, from: DVec3) -> Vec<[f64; 2]> {
    if last.outline.is_empty() {
        return vec![last.part];
    }
    let inward = last.wedge.inward(last.at_second[0]);
    // Along the rim, and from it into the sheet.
    let flat = |point: DVec3| {
        let offset = point - last.wedge.at(0.0);
        [offset.dot(last.wedge.direction()), offset.dot(inward)]
    };
    let [along, height] = flat(from);
    if height <= TOUCH {
        return Vec::new();
    }
    let mut seen = vec![last.part];
    // The rim that the point is on: it sees what is on the inner side of it.
    let into = before.wedge.inward(before.at_second[1]);
    let (at_start, slope) = ((last.wedge.at(0.0) - from).dot(into), last.wedge.direction().dot(into));
    if slope.abs() * last.wedge.length() > TOUCH {
        let border = -at_start / slope;
        let outer = if slope > 0.0 { [f64::NEG_INFINITY, border] } else { [border, f64::INFINITY] };
        seen = without(&seen, outer);
    } else if at_start <= TOUCH {
        return Vec::new();
    }
    for rim in last.outline {
        let Some(ends) = between(rim.map(flat), TOUCH, height - TOUCH) else { continue };
        let shadow = ends.map(|[x, y]| along + (x - along) * height / (height - y));
        seen = without(&seen, [shadow[0].min(shadow[1]), shadow[0].max(shadow[1])]);
    }
    seen
}

/// The part of a line from `low` to `high` in its second coordinate.
fn between(ends: [[f64; 2]; 2], low: f64, high: f64) -> Option<[[f64; 2]; 2]> {
    let [a, b] = ends;
    if a[1].max(b[1]) <= low || a[1].min(b[1]) >= high || low >= high {
        return None;
    }
    let at = |height: f64| {
        let share = (height - a[1]) / (b[1] - a[1]);
        [a[0] + (b[0] - a[0]) * share, height]
    };
    Some(ends.map(|end| {
        if end[1] < low {
            at(low)
        } else if end[1] > high {
            at(high)
        } else {
            end
        }
    }))
}

/// What is left of `stretches` without those between `hidden`.
fn without(stretches: &[[f64; 2]], hidden: [f64; 2]) -> Vec<[f64; 2]> {
    let pieces =
        stretches.iter().flat_map(|&[from, to]| [[from, to.min(hidden[0])], [from.max(hidden[1]), to]]);
    pieces.filter(|[from, to]| to > from).collect()
}
