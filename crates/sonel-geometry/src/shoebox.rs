//! Recognising an empty rectangular room.

use crate::SurfaceId;
use crate::surfaces::Surface;
use glam::DVec3;

/// An empty, axis-aligned rectangular room with one surface for each wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shoebox {
    /// Lower corner, in world coordinates [m].
    pub min: DVec3,
    /// Upper corner, in world coordinates [m].
    pub max: DVec3,
    /// The walls in the order x = min, x = max, y = min, y = max, z = min, z = max.
    pub walls: [SurfaceId; 6],
}

/// The shoebox that some surfaces of one closed shell form, if they do.
pub(crate) fn recognise(surfaces: &[Surface], min: DVec3, max: DVec3, tolerance: f64) -> Option<Shoebox> {
    if surfaces.len() != 6 || !surfaces.iter().all(|surface| surface.closed) {
        return None;
    }
    let size = max - min;
    let mut walls = [None; 6];
    for (index, surface) in surfaces.iter().enumerate() {
        let axis = (0..3).find(|&axis| surface.normal[axis].abs() > 0.5)?;
        // A tilt that lifts no point of the wall by the tolerance is none.
        let tilt = surface.normal.reject_from_normalized(DVec3::AXES[axis]).length() * size.length();
        let far = surface.normal[axis] < 0.0;
        let (wanted, area) = (if far { max } else { min }, size[(axis + 1) % 3] * size[(axis + 2) % 3]);
        let flat = tilt <= tolerance && (surface.centroid[axis] - wanted[axis]).abs() <= tolerance;
        let full = (surface.area - area).abs() <= tolerance * size.element_sum();
        if !flat || !full {
            return None;
        }
        walls[2 * axis + usize::from(far)] = Some(SurfaceId(index as u32));
    }
    let [Some(x0), Some(x1), Some(y0), Some(y1), Some(z0), Some(z1)] = walls else { return None };
    Some(Shoebox { min, max, walls: [x0, x1, y0, y1, z0, z1] })
}
