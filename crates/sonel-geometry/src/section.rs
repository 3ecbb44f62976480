//! Sections of a mesh: the lines in which a plane across an axis cuts its triangles.
//!
//! A corner in the plane counts as above it, so that neighbouring triangles meet in the section as they meet in the mesh, and a triangle that
//! lies in the plane has no line of its own.

use glam::DVec3;

use crate::Mesh;

/// Lines of the section of `mesh` where the coordinate `axis` (0, 1, 2 for x, y, z) is `offset` [m], by their ends.
#[must_use]
pub fn section(mesh: &Mesh, axis: usize, offset: f64) -> Vec<[DVec3; 2]> {
    (0..mesh.triangles.len() as u32)
        .filter_map(|triangle| cut(mesh.corners(triangle), |corner| corner[axis] - offset))
        .filter(|[a, b]| a.distance_squared(*b) > 0.0)
        .collect()
}

/// The segment in which a triangle cuts a plane, by the heights of points over it; none where it only touches it from above.
pub(crate) fn cut(corners: [DVec3; 3], height: impl Fn(DVec3) -> f64) -> Option<[DVec3; 2]> {
    let heights = corners.map(height);
    let mut ends = (0..3).filter_map(|i| {
        let (here, there) = (heights[i], heights[(i + 1) % 3]);
        ((here < 0.0) != (there < 0.0)).then(|| corners[i].lerp(corners[(i + 1) % 3], here / (here - there)))
    });
    Some([ends.next()?, ends.next()?])
}
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_cut_along_its_walls() {
        let mesh = Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]);
        for (axis, perimeter) in [(0, 14.0), (1, 16.0), (2, 18.0)] {
            let lines = section(&mesh, axis, 1.2);
            let length: f64 = lines.iter().map(|[a, b]| a.distance(*b)).sum();
            assert!((length - perimeter).abs() < 1e-12, "{axis}: {length}");
            assert!(lines.iter().flatten().all(|end| (end[axis] - 1.2).abs() < 1e-12));
        }
    }

    #[test]
    fn a_plane_in_a_wall_or_outside_has_the_lines_of_one_side_or_none() {
        let mesh = Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]);
        let floor: f64 = section(&mesh, 2, 0.0).iter().map(|[a, b]| a.distance(*b)).sum();
        let ceiling: f64 = section(&mesh, 2, 3.0).iter().map(|[a, b]| a.distance(*b)).sum();
        assert!(floor.abs() < 1e-12 && (ceiling - 18.0).abs() < 1e-12, "{floor} {ceiling}");
        assert!(section(&mesh, 2, 4.0).is_empty() && section(&Mesh::default(), 0, 0.0).is_empty());
    }
}
