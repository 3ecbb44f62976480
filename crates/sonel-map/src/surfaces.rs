//! The surfaces that paths refer to, as rows of the file, compared with those of a geometry.
//!
//! Which triangles make a surface, and in which order surfaces are numbered, is the work of `sonel-geometry`. The map
//! states the outcome, so that a stranger needs no geometry, and so that a later sonel that finds surfaces in another way
//! refuses the map instead of reading paths off the wrong walls.

use glam::DVec3;
use sonel_geometry::Geometry;

use crate::error::MapError;
use crate::format::SurfaceRow;

/// The rows of `geometry`, in the order of its surface ids.
pub(crate) fn rows(geometry: &Geometry) -> Vec<SurfaceRow> {
    geometry
        .surfaces()
        .iter()
        .map(|surface| SurfaceRow {
            material: surface.material,
            closed: u32::from(surface.closed),
            normal: surface.normal.to_array(),
            offset: surface.offset,
            area: surface.area,
        })
        .collect()
}

/// Whether the rows can be what they claim to be, whatever the geometry; the reason where not.
pub(crate) fn check_rows(rows: &[SurfaceRow], materials: usize) -> Result<(), String> {
    let is_sound = |row: &SurfaceRow| {
        (row.material as usize) < materials
            && row.closed <= 1
            && DVec3::from_array(row.normal).is_normalized()
            && row.offset.is_finite()
            && row.area.is_finite()
    };
    match rows.iter().position(|row| !is_sound(row)) {
        Some(surface) => Err(format!("surface {surface} has no material or no plane")),
        None => Ok(()),
    }
}

/// Whether rows and centre are those of `geometry`, within what its positions can tell apart; the first difference where
/// not.
pub(crate) fn compare(rows: &[SurfaceRow], center: DVec3, geometry: &Geometry) -> Result<(), MapError> {
    let foreign = |reason| Err(MapError::ForeignSurfaces { reason });
    let resolution = f64::from(geometry.resolution());
    let extent = f64::from(geometry.extent());
    let ours = self::rows(geometry);
    if rows.len() != ours.len() {
        return foreign(format!("it has {} surfaces, here are {}", rows.len(), ours.len()));
    }
    if !center.abs_diff_eq(geometry.center(), resolution) {
        return foreign(format!("its centre is {center}, here {}", geometry.center()));
    }
    let is_same = |theirs: &SurfaceRow, ours: &SurfaceRow| {
        let turned = DVec3::from_array(theirs.normal).distance(DVec3::from_array(ours.normal));
        (theirs.material, theirs.closed) == (ours.material, ours.closed)
            && turned * extent <= resolution
            && (theirs.offset - ours.offset).abs() <= resolution
            && (theirs.area - ours.area).abs() <= resolution * extent
    };
    match rows.iter().zip(&ours).position(|(theirs, ours)| !is_same(theirs, ours)) {
        Some(surface) => foreign(format!("surface {surface} is another one")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_geometry::Mesh;

    fn room(depth: f64, materials: [u32; 6]) -> Geometry {
        Geometry::build(Mesh::shoebox([5.0, depth, 3.0], materials)).unwrap()
    }

    #[test]
    fn rows_are_those_of_their_own_geometry_only() {
        let geometry = room(4.0, [0, 0, 0, 0, 1, 0]);
        let (rows, center) = (rows(&geometry), geometry.center());
        assert!(compare(&rows, center, &geometry).is_ok());
        assert!(compare(&rows, center, &room(4.0, [0; 6])).is_err(), "another material");
        assert!(compare(&rows, center, &room(4.001, [0, 0, 0, 0, 1, 0])).is_err(), "another plane");
        assert!(compare(&rows[1..], center, &geometry).is_err(), "another number");
        let mut renumbered = rows.clone();
        renumbered.swap(0, 1);
        assert!(compare(&renumbered, center, &geometry).is_err(), "another order");
        assert!(compare(&rows, center + 0.001, &geometry).is_err(), "another centre");
    }

    #[test]
    fn rows_without_plane_or_material_are_refused() {
        let geometry = room(4.0, [0; 6]);
        let rows = rows(&geometry);
        assert_eq!(check_rows(&rows, 1), Ok(()));
        assert!(check_rows(&rows, 0).is_err());
        for spoil in [
            (|row| row.normal = [0.0; 3]) as fn(&mut SurfaceRow),
            |row| row.offset = f64::NAN,
            |row| row.area = f64::INFINITY,
            |row| row.closed = 2,
        ] {
            let mut spoilt = rows.clone();
            spoil(&mut spoilt[3]);
            assert!(check_rows(&spoilt, 1).is_err());
        }
    }
}
