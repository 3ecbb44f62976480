//! A pinhole camera: one ray through the middle of each pixel.
//!
//! The picture is upright: z is up. Where the camera looks along z, y is up.

use glam::DVec3;
use sonel_geometry::{Departure, Geometry, Hit, Side};
use thiserror::Error;

/// Most pixels along and across: a square picture of one band then has the most values that a picture may have.
pub const MOST_PIXELS: u32 = 16_384;
/// Sine of the angle to the vertical below which y is up: aims written with six digits are known to that.
const VERTICAL: f64 = 1e-6;
/// Most walls that a ray passes from behind. It ends rays that find the same wall for ever.
const MOST_BACKS: usize = 1024;

/// A camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    eye: DVec3,
    forward: DVec3,
    /// To the right and upper border of the picture, at unit distance.
    right: DVec3,
    up: DVec3,
    size: [u32; 2],
}

/// Why there is no such camera.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CameraError {
    /// No direction to look in.
    #[error("the camera at {eye} m looks at {look} m: give two different points with finite coordinates")]
    Direction {
        /// Where it is [m].
        eye: DVec3,
        /// Point at the middle of the picture [m].
        look: DVec3,
    },
    /// A field of view that no plane picture has.
    #[error("a field of view of {0}° cannot be drawn: give one above 0° and below 180°, such as 70")]
    FieldOfView(f64),
    /// No pixels, or too many.
    #[error("a picture of {0}x{1} pixels cannot be drawn: give 1 … {MOST_PIXELS} each way")]
    Size(u32, u32),
    /// A place from which nothing is seen.
    #[error(
        "the camera at {eye} m is nearer than {:.2} mm to a surface: move it away",
        libm::ceil(1e5 * clearance) / 100.0
    )]
    OnSurface {
        /// Where it is [m].
        eye: DVec3,
        /// Least distance [m].
        clearance: f64,
    },
}

impl Camera {
    /// A camera at `eye` that looks at `look`, with a horizontal field of view of `fov_degrees` (above 0, below 180) and `size` pixels
    /// across and down. Positions are in the scene's axes [m].
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn new(
        eye: DVec3,
        look: DVec3,
        fov_degrees: f64,
        size: [u32; 2],
        geometry: &Geometry,
    ) -> Result<Self, Vec<CameraError>> {
        let mut errors = Vec::new();
        let forward = (look - eye).try_normalize().filter(|_| eye.is_finite() && look.is_finite());
        if forward.is_none() {
            errors.push(CameraError::Direction { eye, look });
        }
        if !(fov_degrees > 0.0 && fov_degrees < 180.0) {
            errors.push(CameraError::FieldOfView(fov_degrees));
        }
        let [width, height] = size;
        if [width, height].iter().any(|pixels| !(1..=MOST_PIXELS).contains(pixels)) {
            errors.push(CameraError::Size(width, height));
        }
        let clearance = geometry.clearance();
        let distance = if eye.is_finite() { geometry.distance_to_nearest_surface(eye) } else { clearance };
        if distance < clearance {
            errors.push(CameraError::OnSurface { eye, clearance });
        }
        let Some(forward) = forward.filter(|_| errors.is_empty()) else { return Err(errors) };
        let level = forward.cross(DVec3::Z);
        let level = if level.length() < VERTICAL { forward.cross(DVec3::Y) } else { level }.normalize();
        let half = libm::tan(0.5 * fov_degrees.to_radians());
        let up = level.cross(forward) * half * f64::from(height) / f64::from(width);
        Ok(Self { eye, forward, right: level * half, up, size })
    }

    /// Pixels across and down.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Unit direction through the middle of the pixel in `column` from the left and `row` from the top.
    #[must_use]
    pub fn direction(&self, column: u32, row: u32) -> DVec3 {
        let place = |index: u32, count: u32| (2.0 * f64::from(index) + 1.0) / f64::from(count) - 1.0;
        let (x, y) = (place(column, self.size[0]), place(row, self.size[1]));
        (self.forward + x * self.right - y * self.up).normalize()
    }

    /// What the pixel in `column` and `row` shows; [`None`] where there is no surface. The backs of a closed room's hull and of closed
    /// objects, on which nothing arrives, are left out: a camera outside looks into the room. So are interfaces between airs.
    #[must_use]
    pub fn sees(&self, geometry: &Geometry, column: u32, row: u32) -> Option<Hit> {
        let direction = self.direction(column, row).as_vec3().normalize();
        let mut from = Departure::free(geometry.to_local(self.eye));
        for _ in 0..MOST_BACKS {
            let hit = geometry.closest_hit(from, direction)?;
            let surface = geometry.surface(hit.surface);
            if !surface.interface && (hit.side == Side::Front || !surface.closed) {
                return Some(hit);
            }
            from = geometry.leave(hit.position, hit.surface, hit.side.opposite());
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_geometry::Mesh;

    fn room() -> Geometry {
        Geometry::build(Mesh::shoebox([6.0, 4.0, 3.0], [0; 6])).unwrap()
    }

    fn camera(eye: [f64; 3], look: [f64; 3], fov: f64, size: [u32; 2]) -> Result<Camera, Vec<CameraError>> {
        Camera::new(DVec3::from_array(eye), DVec3::from_array(look), fov, size, &room())
    }

    #[test]
    fn the_picture_is_upright_and_as_wide_as_its_field_of_view() {
        // Towards +y, x is to the right and z is up.
        let level = camera([3.0, 1.0, 1.5], [3.0, 2.0, 1.5], 90.0, [1000, 500]).unwrap();
        let [left, right] = [0, 999].map(|column| level.direction(column, 250));
        let angle = libm::acos(left.dot(right)).to_degrees();
        assert!((angle - 90.0).abs() < 0.15 && right.x > 0.7, "{angle}° to {right}");
        assert!(level.direction(500, 0).z > 0.4 && level.direction(500, 499).z < -0.4);
        // Down at the floor, as on a plan.
        let plan = camera([3.0, 2.0, 2.5], [3.0, 2.0, 0.0], 60.0, [100, 100]).unwrap();
        assert!(plan.direction(99, 50).x > 0.4 && plan.direction(50, 0).y > 0.4);
    }

    #[test]
    fn a_camera_outside_looks_past_the_walls_before_it() {
        let room = room();
        let seen = |eye: [f64; 3]| {
            let camera = camera(eye, [3.0, 2.0, 1.5], 30.0, [9, 9]).unwrap();
            camera.sees(&room, 4, 4).map(|hit| (room.to_world(hit.position).x.round(), hit.side))
        };
        assert_eq!(seen([1.0, 2.0, 1.5]), Some((6.0, Side::Front)));
        assert_eq!(seen([-20.0, 2.0, 1.5]), Some((6.0, Side::Front)));
        let away = camera([-20.0, 2.0, 1.5], [-30.0, 2.0, 1.5], 30.0, [9, 9]).unwrap();
        assert_eq!(away.sees(&room, 4, 4), None);
    }

    #[test]
    fn everything_that_is_wrong_is_said_at_once() {
        let errors = camera([0.0; 3], [0.0; 3], 180.0, [0, 99_999]).unwrap_err();
        assert!(
            matches!(
                errors[..],
                [
                    CameraError::Direction { .. },
                    CameraError::FieldOfView(_),
                    CameraError::Size(0, 99_999),
                    CameraError::OnSurface { .. }
                ]
            ),
            "{errors:?}"
        );
        assert!(camera([f64::NAN, 1.0, 1.0], [1.0; 3], f64::NAN, [1, 1]).is_err());
    }
}
