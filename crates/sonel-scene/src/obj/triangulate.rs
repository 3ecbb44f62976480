//! Polygons to triangles, concave ones too.
//!
//! A polygon is projected on its plane (Newell's normal) and cut into ears by `earcutr`. Ear cutting leaves out corners
//! that lie on a straight edge; they are put back, because the neighbour across that edge has them and the two would
//! otherwise not share an edge.
//!
//! Reference: [Newell1972] as in [Sutherland1974] (docs/references.md).

use std::collections::HashSet;

use glam::{DVec2, DVec3};
use thiserror::Error;

/// Distance of corners from their plane over the polygon's diameter [1] above which a note names it: positions written with five figures stay
/// below.
const BENT: f64 = 1e-4;
/// The same ratio and the distance [m] that both have to be exceeded for an error: the author has to choose the diagonal to fold. The distance
/// is that of a wall's faces, here of a thin one. Chosen, not measured; doubled, 4 cm on a metre and 20 cm on any face pass.
const TOO_BENT: f64 = 0.02;
const THIN_WALL: f64 = 0.1;
/// Area over squared diameter [1] up to which a polygon may be a line written in single precision: some ten times 6e-8.
const LINE: f64 = 1e-6;
/// Width over diameter [1] above which a polygon without area is no line: written in single precision it is 1e-7 wide. Chosen, not measured;
/// doubled, crossing outlines of 2 mm on a metre are lines.
const NARROW: f64 = 1e-3;
/// Difference of areas over squared diameter [1] up to which triangles cover a polygon: overlaps of one that crosses itself are larger.
const AREA_ROUNDING: f64 = 1e-9;

/// A polygon in triangles, oriented as the polygon.
#[derive(Debug, PartialEq)]
pub(crate) struct Triangulation {
    /// Indices of the polygon's corners; none when it has no area.
    pub(crate) triangles: Vec<[usize; 3]>,
    /// Distance by which the corners leave their plane noticeably [m], else 0.
    pub(crate) bend: f64,
}

/// Why a polygon is no wall.
#[derive(Clone, Debug, PartialEq, Error)]
pub(crate) enum NoWall {
    #[error("f: the corners leave their plane by {by:.3} m; split the face into triangles")]
    Bent { by: f64 },
    #[error("f: the outline crosses itself; split the face")]
    Crossing,
}

/// Cuts a polygon of at least three corners [m].
pub(crate) fn triangulate(corners: &[DVec3]) -> Result<Triangulation, NoWall> {
    if corners.len() == 3 {
        return Ok(Triangulation { triangles: vec![[0, 1, 2]], bend: 0.0 });
    }
    let vector_area = vector_area(corners);
    // Halves of an outline that crosses itself may cancel.
    if is_line(corners) && width(corners) > NARROW * diameter(corners) {
        return Err(NoWall::Crossing);
    }
    let Some(normal) = vector_area.try_normalize() else {
        return Ok(Triangulation { triangles: Vec::new(), bend: 0.0 });
    };
    let off_plane = corners.iter().map(|corner| (*corner - corners[0]).dot(normal));
    let (lowest, highest) =
        off_plane.fold((0.0, 0.0), |(low, high): (f64, f64), d| (low.min(d), high.max(d)));
    let diameter = diameter(corners);
    let by = highest - lowest;
    if by > f64::max(TOO_BENT * diameter, THIN_WALL) {
        return Err(NoWall::Bent { by });
    }
    let (right, up) = normal.any_orthonormal_pair();
    let project =
        |corner: &DVec3| DVec2::new((*corner - corners[0]).dot(right), (*corner - corners[0]).dot(up));
    let outline: Vec<DVec2> = corners.iter().map(project).collect();
    let triangles = restore_skipped(ears(&outline)?, corners.len());
    let covered: f64 = triangles.iter().map(|triangle| doubled_area(&outline, *triangle).abs() / 2.0).sum();
    if (covered - vector_area.length()).abs() > AREA_ROUNDING * diameter * diameter {
        return Err(NoWall::Crossing);
    }
    Ok(Triangulation { triangles, bend: if by > BENT * diameter { by } else { 0.0 } })
}

/// Whether a polygon is so narrow that only rounding may give it an area.
pub(crate) fn is_line(corners: &[DVec3]) -> bool {
    let diameter = diameter(corners);
    vector_area(corners).length() <= LINE * diameter * diameter
}

/// Largest distance of a corner from the line through the first corner and the one farthest from it [m].
fn width(corners: &[DVec3]) -> f64 {
    let from_first = corners.iter().map(|corner| *corner - corners[0]);
    let farthest = from_first.clone().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let along = farthest.and_then(DVec3::try_normalize).unwrap_or_default();
    from_first.map(|offset| offset.reject_from_normalized(along).length()).fold(0.0, f64::max)
}

/// Newell's vector area of a polygon [m²]: normal to it, as long as its area.
fn vector_area(corners: &[DVec3]) -> DVec3 {
    let origin = corners[0];
    let fan = corners.windows(2).map(|pair| (pair[0] - origin).cross(pair[1] - origin));
    fan.sum::<DVec3>() / 2.0
}

/// Diagonal of the box about the corners [m].
fn diameter(corners: &[DVec3]) -> f64 {
    let lowest = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let highest = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    highest.distance(lowest)
}

/// Triangles between corners of a plane outline, counter-clockwise as the outline.
fn ears(outline: &[DVec2]) -> Result<Vec<[usize; 3]>, NoWall> {
    let coordinates: Vec<f64> = outline.iter().flat_map(|corner| corner.to_array()).collect();
    let indices = earcutr::earcut(&coordinates, &[], 2).map_err(|_| NoWall::Crossing)?;
    let oriented = |t: &[usize]| match doubled_area(outline, [t[0], t[1], t[2]]) {
        clockwise if clockwise < 0.0 => [t[0], t[2], t[1]],
        _ => [t[0], t[1], t[2]],
    };
    Ok(indices.chunks_exact(3).map(oriented).collect())
}

/// Twice the signed area of a triangle between corners of an outline [m²].
fn doubled_area(outline: &[DVec2], triangle: [usize; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| outline[corner]);
    (b - a).perp_dot(c - a)
}

/// Splits triangles at corners of the outline that lie on one of their edges and were skipped.
fn restore_skipped(triangles: Vec<[usize; 3]>, count: usize) -> Vec<[usize; 3]> {
    let mut is_used = vec![false; count];
    triangles.iter().flatten().for_each(|corner| is_used[*corner] = true);
    if is_used.iter().all(|is_used| *is_used) {
        return triangles;
    }
    let mut edges: HashSet<(usize, usize)> =
        triangles.iter().flat_map(|[a, b, c]| [(*a, *b), (*b, *c), (*c, *a)]).collect();
    let mut open = triangles;
    let mut complete = Vec::new();
    while let Some([a, b, c]) = open.pop() {
        // An edge of the outline is walked one way only; whatever the outline has between its ends was skipped.
        let skips = |[from, to, _]: &[usize; 3]| {
            let next = (from + 1) % count;
            next != *to && !is_used[next] && !edges.contains(&(*to, *from))
        };
        match [[a, b, c], [b, c, a], [c, a, b]].into_iter().find(skips) {
            Some([from, to, apex]) => {
                let skipped = (from + 1) % count;
                edges.extend([(skipped, apex), (apex, skipped)]);
                open.extend([[from, skipped, apex], [skipped, to, apex]]);
            }
            None => complete.push([a, b, c]),
        }
    }
    complete
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(corners: &[[f64; 3]]) -> Vec<DVec3> {
        corners.iter().map(|corner| DVec3::from(*corner)).collect()
    }

    /// Area of the triangles along the polygon's normal, each counted with its sign [m²].
    fn signed_area(corners: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        let normal = vector_area(corners).normalize();
        let area =
            |t: &[usize; 3]| (corners[t[1]] - corners[t[0]]).cross(corners[t[2]] - corners[t[0]]).dot(normal);
        triangles.iter().map(|triangle| area(triangle) / 2.0).sum()
    }

    fn smallest_area(corners: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        triangles.iter().map(|triangle| signed_area(corners, &[*triangle])).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn concave_polygon_is_cut_inside_its_outline() {
        // An L in a tilted plane; a fan from its first corner would leave the outline.
        let l = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [3.0, 2.0], [3.0, 3.0], [0.0, 3.0]];
        for reversed in [false, true] {
            let mut corners: Vec<DVec3> = l.iter().map(|[x, y]| DVec3::new(*x, *y, 0.5 * x + 7.0)).collect();
            if reversed {
                corners.reverse();
            }
            let cut = triangulate(&corners).unwrap();
            assert_eq!(cut.triangles.len(), 4);
            assert!(cut.bend <= 0.0);
            let area = 5.0 * 1.25f64.sqrt();
            assert!((signed_area(&corners, &cut.triangles) - area).abs() < 1e-12);
            assert!(smallest_area(&corners, &cut.triangles) > 0.0);
        }
    }

    #[test]
    fn corners_on_straight_edges_are_kept() {
        let corners = polygon(&[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [3.0, 0.0, 0.0],
            [0.0, 3.0, 0.0],
            [0.0, 2.0, 0.0],
            [0.0, 1.0, 0.0],
        ]);
        for shift in 0..corners.len() {
            let mut turned = corners.clone();
            turned.rotate_left(shift);
            let triangles = triangulate(&turned).unwrap().triangles;
            assert!((0..7).all(|corner| triangles.iter().flatten().any(|used| *used == corner)), "{shift}");
            assert_eq!(triangles.len(), 5, "{shift}");
            assert!((signed_area(&turned, &triangles) - 4.5).abs() < 1e-12, "{shift}");
            assert!(smallest_area(&turned, &triangles) > 0.0, "{shift}");
        }
    }

    #[test]
    fn halves_that_cancel_are_a_crossing_and_lines_are_none() {
        let bow_tie = polygon(&[[4.0, 1.0, 0.0], [4.0, 3.0, 1.5], [4.0, 3.0, 0.0], [4.0, 1.0, 1.5]]);
        assert_eq!(triangulate(&bow_tie), Err(NoWall::Crossing));
        let line = polygon(&[[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [3.0, 3.0, 0.0], [2.0, 2.0, 0.0]]);
        assert!(triangulate(&line).unwrap().triangles.is_empty());
    }

    #[test]
    fn restoring_splits_the_edge_that_skipped() {
        let mut restored = restore_skipped(vec![[0, 2, 3]], 5);
        for triangle in &mut restored {
            while triangle[0] > triangle[1].min(triangle[2]) {
                triangle.rotate_left(1);
            }
        }
        restored.sort_unstable();
        // 1 was skipped between 0 and 2, and 4 between 3 and 0.
        assert!(
            restored == [[0, 1, 3], [0, 3, 4], [1, 2, 3]] || restored == [[0, 1, 4], [1, 2, 3], [1, 3, 4]]
        );
    }

    #[test]
    fn bent_polygons_are_noted_then_refused() {
        let quad = |size: f64, height: f64| {
            polygon(&[[0.0, 0.0, 0.0], [size, 0.0, 0.0], [size, size, height], [0.0, size, 0.0]])
        };
        let bend = |size: f64, height: f64| triangulate(&quad(size, height)).map(|cut| cut.bend);
        assert_eq!(bend(1.0, 1e-6), Ok(0.0));
        assert!((0.004..=0.006).contains(&bend(1.0, 1e-2).unwrap()));
        // As stones of an arch are: a share of their size, less than a thin wall.
        assert!((0.004..=0.006).contains(&bend(0.2, 1e-2).unwrap()));
        assert!(matches!(bend(1.0, 0.3), Err(NoWall::Bent { .. })));
        assert!(bend(20.0, 0.3).is_ok());
    }

    #[test]
    fn crossing_outline_is_refused() {
        let bow = polygon(&[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 2.0, 0.0]]);
        assert_eq!(triangulate(&bow), Err(NoWall::Crossing));
    }

    #[test]
    fn polygon_without_area_gives_no_triangle() {
        let line = polygon(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
        assert_eq!(triangulate(&line).unwrap().triangles, Vec::<[usize; 3]>::new());
    }
}
