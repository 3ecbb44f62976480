//! Which part of an edge counts for an end that another object lets see a part only of the edge behind it.

use super::FaceEdge;
use super::weight::smooth;
use crate::wedge::WedgePoint;

/// How much longer the way over the last edge is than straight on where what is hidden of it no longer hides what is behind it [m]: centimetres
/// off the plane of the face.
const CLEAR: f64 = 4e-4;
/// What is nearer than this to the end of an edge is its end [m].
const AT_THE_END: f64 = 1e-6;

/// The parts of the edge `before` that send what the `receiver` hears over the `last` one, each with its share.
///
/// In the plane of the face between them it hears no more past the last edge than it sees straight over the part of it that it sees; farther off
/// what the whole edge sends to that part. What passes an end of the last edge goes over another edge of the face.
pub(super) fn seen_over([before, last]: [&FaceEdge<'_>; 2], receiver: WedgePoint) -> Vec<([f64; 2], f64)> {
    let seen = straight_over([before, last], receiver);
    if seen.iter().zip(before.part).all(|(seen, own)| (seen - own).abs() <= AT_THE_END) {
        return vec![(before.part, 1.0)];
    }
    let off = smooth(beyond_straight([before, last], receiver) / CLEAR);
    let parts = [(before.part, off), (seen, 1.0 - off)];
    parts.into_iter().filter(|([from, to], share)| to - from > AT_THE_END && *share > f64::EPSILON).collect()
}

/// The part of the edge `before` that the `receiver`, turned into the plane of the face, sees over that of the `last` one.
fn straight_over([before, last]: [&FaceEdge<'_>; 2], receiver: WedgePoint) -> [f64; 2] {
    let ends = before.part.map(|along| last.wedge.in_plane(before.wedge.at(along), last.face(0)));
    let [mut from, mut to] = before.part;
    let cuts = [
        (last.part[0] > AT_THE_END, last.part[0], 1.0),
        (last.part[1] < last.wedge.length() - AT_THE_END, last.part[1], -1.0),
    ];
    for (_, place, sign) in cuts.into_iter().filter(|(is_cut, ..)| *is_cut) {
        // By how much the straight way from each end passes on the seen side of the place, times the sum of both radii.
        let [a, b] = ends.map(|end| {
            sign * (receiver.radius * (end.along - place) + end.radius * (receiver.along - place))
        });
        let crossing = before.part[0] + (before.part[1] - before.part[0]) * a / (a - b);
        match (a < 0.0, b < 0.0) {
            (false, false) => {}
            (true, true) => to = from,
            (true, false) => from = from.max(crossing),
            (false, true) => to = to.min(crossing),
        }
    }
    [from, to.max(from)]
}

/// How much longer the way from the middle of the edge `before` to the `receiver` is over the `last` edge than straight [m].
fn beyond_straight([before, last]: [&FaceEdge<'_>; 2], receiver: WedgePoint) -> f64 {
    let middle = before.wedge.at(0.5 * (before.part[0] + before.part[1]));
    let from = last.wedge.in_plane(middle, last.face(0));
    let half = libm::cos(0.5 * (receiver.angle - last.face(0)));
    let (sum, offset) = (from.radius + receiver.radius, receiver.along - from.along);
    let over = libm::hypot(sum, offset);
    let excess = 4.0 * from.radius * receiver.radius * half * half;
    excess / (over + (over * over - excess).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wedge::Wedge;
    use glam::{DVec3, dvec3};

    /// Two edges of a top three metres long, one metre apart, and a receiver a metre behind the second, where that is seen up to half its length.
    #[test]
    fn past_a_hidden_part_of_an_edge_no_more_is_seen_than_straight() {
        let top = |x: f64, into: f64| {
            let ends = [dvec3(x, -1.5, 0.0), dvec3(x, 1.5, 0.0)];
            Wedge::new(ends, DVec3::X * into, DVec3::Z, 1.5 * std::f64::consts::PI).unwrap()
        };
        let [front, rear] = [top(-1.0, 1.0), top(0.0, -1.0)];
        let edge = |wedge, part| FaceEdge { wedge, at_second: [false; 2], part, outline: &[] };
        let seen = |part: [f64; 2], height: f64| {
            let receiver = rear.locate(dvec3(1.0, 0.75, height)).unwrap();
            seen_over([&edge(&front, [0.0, 3.0]), &edge(&rear, part)], receiver)
        };
        assert_eq!(
            seen([0.0, 3.0], 0.0),
            [([0.0, 3.0], 1.0)],
            "beside its own ends the way goes over another edge"
        );
        // From y = 0.75 past y = 0 of the rear edge to y = −0.75 of the front one.
        let [([from, to], share)] = seen([0.0, 1.5], 0.0)[..] else { panic!("one part in the plane") };
        assert!(
            from.abs() < 1e-9 && (to - 0.75).abs() < 1e-9 && (share - 1.0).abs() < 1e-9,
            "{from} {to} {share}"
        );
        let beside = seen([0.0, 1.5], 0.02);
        let sum: f64 = beside.iter().map(|(_, share)| share).sum();
        assert!(beside.len() == 2 && (sum - 1.0).abs() < 1e-12, "{beside:?}");
        assert_eq!(seen([0.0, 1.5], 0.5), [([0.0, 3.0], 1.0)]);
    }
}
