//! The area that a point on a planar surface sees of it where walls stand on it.
//!
//! A sweep around the point. Between two directions at which something begins, ends or crosses something else, every ray meets the same
//! segments in the same order: the surface's boundary is entered and left, the first foot of a wall or the circle ends it. Each piece is a
//! triangle, or a sector of the circle, from the point.

use core::f64::consts::{PI, TAU};

use glam::DVec2;

/// Both ends of a straight line in the plane of a surface [m].
pub(super) type Segment = (DVec2, DVec2);

/// Distance of the line from `a` to `b` from the origin [m].
pub(super) fn distance_to(a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let share = (-a.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (a + share * along).length()
}

/// Angle below which directions are one [rad]: 0.01 nm over 10 m, above the rounding of atan2.
const LEAST_ANGLE: f64 = 1e-12;

/// Area within `radius` [m] of the origin, a point of the surface with the oriented `boundary`, that is seen past `feet` [m²].
#[must_use]
pub(super) fn visible_area(boundary: &[Segment], feet: &[Segment], radius: f64) -> f64 {
    let near = |segments: &[Segment]| -> Vec<Segment> {
        segments.iter().copied().filter(|&(a, b)| distance_to(a, b) < radius).collect()
    };
    let (boundary, feet) = (near(boundary), near(feet));
    let directions = directions(&boundary, &feet, radius);
    let next = directions.iter().skip(1).copied().chain(directions.first().map(|first| first + TAU));
    directions
        .iter()
        .zip(next)
        .filter(|(from, to)| to - *from > LEAST_ANGLE)
        .map(|(&from, to)| wedge_area(&boundary, &feet, radius, from, to))
        .sum()
}

/// Angles at which the order of segments along a ray can change, ascending [rad].
fn directions(boundary: &[Segment], feet: &[Segment], radius: f64) -> Vec<f64> {
    let mut points = vec![DVec2::X];
    for &(a, b) in boundary.iter().chain(feet) {
        points.extend([a, b]);
        points.extend(on_circle(a, b, radius));
    }
    for (index, &foot) in feet.iter().enumerate() {
        let others = boundary.iter().chain(&feet[index + 1..]);
        points.extend(others.filter_map(|&other| crossing(foot, other)));
    }
    let mut directions: Vec<f64> = points.into_iter().map(|point| libm::atan2(point.y, point.x)).collect();
    directions.sort_unstable_by(f64::total_cmp);
    directions
}

/// Points where the line through `a` and `b` meets the circle about the origin; a line that passes beside it has none.
fn on_circle(a: DVec2, b: DVec2, radius: f64) -> impl Iterator<Item = DVec2> {
    let along = (b - a).normalize_or_zero();
    let foot = a - a.dot(along) * along;
    let half = libm::sqrt((radius * radius - foot.length_squared()).max(0.0));
    [foot - half * along, foot + half * along].into_iter()
}

/// The point that two segments share.
fn crossing((a, b): Segment, (c, d): Segment) -> Option<DVec2> {
    let (first, second) = (b - a, d - c);
    let area = first.perp_dot(second);
    let (on_first, on_second) = ((c - a).perp_dot(second) / area, (c - a).perp_dot(first) / area);
    let within = |share: f64| (0.0..=1.0).contains(&share);
    (within(on_first) && within(on_second)).then(|| a + on_first * first)
}

/// Area seen between two directions between which nothing begins, ends or crosses.
fn wedge_area(boundary: &[Segment], feet: &[Segment], radius: f64, from: f64, to: f64) -> f64 {
    let middle = direction(0.5 * (from + to));
    let end = feet
        .iter()
        .filter_map(|&foot| Some((distance_along(foot, middle)?, Some(foot))))
        .fold((radius, None), |nearest, met| if met.0 < nearest.0 { met } else { nearest });
    let area = |segment: Option<Segment>| match segment {
        Some(segment) => 0.5 * on_ray(segment, from).perp_dot(on_ray(segment, to)),
        None => 0.5 * radius * radius * (to - from),
    };
    // The surface is left over an edge that has it on its left: then the ray passes to its right.
    let mut last = (0.0, true);
    let mut sum = 0.0;
    for &edge in boundary {
        let Some(distance) = distance_along(edge, middle).filter(|&distance| distance < end.0) else {
            continue;
        };
        let enters = (edge.1 - edge.0).perp_dot(middle) > 0.0;
        sum += if enters { -area(Some(edge)) } else { area(Some(edge)) };
        if distance >= last.0 {
            last = (distance, enters);
        }
    }
    if last.1 { sum + area(end.1) } else { sum }
}

/// Distance from the origin at which a ray meets a segment [m].
fn distance_along((a, b): Segment, direction: DVec2) -> Option<f64> {
    let along = b - a;
    let steepness = direction.perp_dot(along);
    let (distance, share) = (a.perp_dot(along) / steepness, a.perp_dot(direction) / steepness);
    (distance >= 0.0 && (0.0..=1.0).contains(&share)).then_some(distance)
}

/// The point of a segment in a direction; the nearer end where rounding puts it beside.
fn on_ray((a, b): Segment, angle: f64) -> DVec2 {
    let (along, direction) = (b - a, direction(angle));
    let share = a.perp_dot(direction) / direction.perp_dot(along);
    if share.is_finite() { a + share.clamp(0.0, 1.0) * along } else { a }
}

fn direction(angle: f64) -> DVec2 {
    let angle = if angle > PI { angle - TAU } else { angle };
    DVec2::new(libm::cos(angle), libm::sin(angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An L of three unit squares, the origin in the lower left one.
    fn letter(origin: DVec2) -> Vec<Segment> {
        let corners =
            [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]].map(DVec2::from_array);
        (0..6).map(|i| (corners[i] - origin, corners[(i + 1) % 6] - origin)).collect()
    }

    #[test]
    fn without_feet_the_area_is_that_of_the_clipped_disc() {
        for (origin, radius, expected) in [
            ([0.5, 0.5], 0.3, PI * 0.09),
            ([0.5, 0.5], 9.0, 3.0),
            ([1e-12, 1e-12], 0.5, PI * 0.0625),
            ([1.0 - 1e-12, 1.0 - 1e-12], 0.5, PI * 0.1875),
            ([1.5, 1e-12], 0.5, PI * 0.125),
        ] {
            let area = visible_area(&letter(DVec2::from_array(origin)), &[], radius);
            assert!((area - expected).abs() < 1e-9, "{origin:?} {radius}: {area} instead of {expected}");
        }
    }

    #[test]
    fn walls_around_the_inner_corner_hide_what_lies_beyond_it() {
        // From (1.5, 0.5) the part of the upper square beyond the line through (1, 1) to (0, 2) is not seen.
        let origin = DVec2::new(1.5, 0.5);
        let boundary = letter(origin);
        let area = visible_area(&boundary, &boundary[2..4], 9.0);
        assert!((area - 2.5).abs() < 1e-9, "{area}");
    }
}
